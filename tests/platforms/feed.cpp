// Runs a Windows program whose standard input is a pipe of Windows, with the bytes of a file and no end, as a rig's:
//   feed.exe FILE PROGRAM WORDS...
// Ends with the program's exit code. Words must have no quotation marks inside.
#include <windows.h>

#include <cstdio>
#include <string>

namespace {

int failed(const char* what) {
    std::fprintf(stderr, "feed.exe: %s: error %lu\n", what, ::GetLastError());
    return 1;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) return failed("usage: feed.exe FILE PROGRAM WORDS...");
    std::string words;
    for (int i = 2; i < argc; ++i) words += (words.empty() ? "\"" : " \"") + std::string(argv[i]) + "\"";
    SECURITY_ATTRIBUTES inherited = {sizeof inherited, nullptr, TRUE};
    HANDLE out = nullptr, in = nullptr;
    if (!::CreatePipe(&out, &in, &inherited, 0)) return failed("no pipe");
    ::SetHandleInformation(in, HANDLE_FLAG_INHERIT, 0);
    STARTUPINFOA start{};
    start.cb = sizeof start;
    start.dwFlags = STARTF_USESTDHANDLES;
    start.hStdInput = out;
    start.hStdOutput = ::GetStdHandle(STD_OUTPUT_HANDLE);
    start.hStdError = ::GetStdHandle(STD_ERROR_HANDLE);
    PROCESS_INFORMATION program{};
    if (!::CreateProcessA(nullptr, words.data(), nullptr, nullptr, TRUE, 0, nullptr, nullptr, &start, &program))
        return failed("the program does not start");
    ::SetConsoleCtrlHandler(nullptr, TRUE);  // keys are for the program
    ::CloseHandle(out);
    std::FILE* file = std::fopen(argv[1], "rb");
    if (!file) return failed("the file cannot be read");
    std::string piece(65536, '\0');
    DWORD written = 0;
    while (const std::size_t bytes = std::fread(piece.data(), 1, piece.size(), file))
        if (!::WriteFile(in, piece.data(), static_cast<DWORD>(bytes), &written, nullptr)) break;
    std::fclose(file);
    ::WaitForSingleObject(program.hProcess, INFINITE);
    DWORD code = 1;
    ::GetExitCodeProcess(program.hProcess, &code);
    return static_cast<int>(code);
}
