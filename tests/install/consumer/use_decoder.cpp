// Decodes a stream by the installed library: use_decoder FILE.htvm. Prints number, kind, vertices, triangles per frame.
#include <fstream>
#include <htvm/decoder.hpp>
#include <iostream>
#include <iterator>

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    std::ifstream file(argv[1], std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    htvm::PacketReader reader;
    htvm::Decoder decoder;
    reader.push(bytes);
    while (const auto packet = reader.pull()) {
        const auto frame = decoder.decode(*packet);
        if (!frame) {
            std::cerr << frame.error().message << "\n";
            return 1;
        }
        if (!*frame) continue;
        std::cout << (*frame)->info.frame << ' ' << htvm::kind_of((*frame)->info.type).letter[0] << ' '
                  << (*frame)->mesh.positions.size() << ' ' << (*frame)->mesh.triangles.size() << "\n";
    }
    return 0;
}
