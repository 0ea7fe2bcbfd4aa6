#include <fcntl.h>
#include <io.h>
#include <windows.h>

#include "command_line/console.h"
// After windows.h, which it needs.
#include <shellapi.h>

#include <cstdio>

namespace htvm::app {
namespace {

std::string utf8_of(const wchar_t* text) {
    const int bytes = ::WideCharToMultiByte(CP_UTF8, 0, text, -1, nullptr, 0, nullptr, nullptr);
    if (bytes <= 1) return {};
    std::string out(static_cast<std::size_t>(bytes), '\0');
    ::WideCharToMultiByte(CP_UTF8, 0, text, -1, out.data(), bytes, nullptr, nullptr);
    out.pop_back();  // the zero at its end
    return out;
}

}  // namespace

void prepare_console() {
    for (auto* stream : {stdin, stdout}) ::_setmode(::_fileno(stream), _O_BINARY);
    ::SetConsoleOutputCP(CP_UTF8);
    // Lines that are overwritten, as those of progress.
    const HANDLE errors = ::GetStdHandle(STD_ERROR_HANDLE);
    DWORD mode = 0;
    if (::GetConsoleMode(errors, &mode)) ::SetConsoleMode(errors, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
}

// Windows itself has them in UTF-16; what main() is given lacks letters that the system's language does not have.
std::vector<std::string> given_words(int argc, char** argv) {
    int count = 0;
    wchar_t** words = ::CommandLineToArgvW(::GetCommandLineW(), &count);
    std::vector<std::string> out;
    if (!words) {
        out.assign(argv + (argc > 0), argv + argc);
        return out;
    }
    for (int i = 1; i < count; ++i) out.push_back(utf8_of(words[i]));
    ::LocalFree(words);
    return out;
}

bool errors_go_to_terminal() { return ::_isatty(::_fileno(stderr)) != 0; }

std::size_t columns_of_output() {
    CONSOLE_SCREEN_BUFFER_INFO about{};
    if (!::GetConsoleScreenBufferInfo(::GetStdHandle(STD_OUTPUT_HANDLE), &about)) return 0;
    return static_cast<std::size_t>(about.srWindow.Right - about.srWindow.Left + 1);
}

// A pipe says how much is in it; all else is read at once.
InputPiece read_input(std::span<char> out) {
    const HANDLE input = ::GetStdHandle(STD_INPUT_HANDLE);
    DWORD there = 0;
    if (::GetFileType(input) == FILE_TYPE_PIPE && ::PeekNamedPipe(input, nullptr, 0, nullptr, &there, nullptr) &&
        there == 0) {
        ::Sleep(10);
        return {};
    }
    DWORD got = 0;
    if (!::ReadFile(input, out.data(), static_cast<DWORD>(out.size()), &got, nullptr) || got == 0)
        return {.bytes = 0, .is_end = true};
    return {.bytes = got};
}

}  // namespace htvm::app
