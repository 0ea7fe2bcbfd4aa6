// Encodes what examples/encode.c encodes, by the installed C++ library: use_encoder FILE.htvm. The bytes are the same.
#include <fstream>
#include <htvm/htvm.hpp>
#include <iostream>

namespace {

// A sheet of 200 mm that bends a little more in every frame.
htvm::Mesh sheet(int frame) {
    constexpr int side = 20;
    htvm::Mesh mesh;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const int from_middle = x - side / 2;
            mesh.positions.push_back({10.0f * static_cast<float>(x), 10.0f * static_cast<float>(y),
                                      0.1f * static_cast<float>(frame * from_middle * from_middle)});
            mesh.colours.push_back({static_cast<std::uint8_t>(x * 12), static_cast<std::uint8_t>(y * 12), 100});
        }
    for (std::uint32_t y = 0; y + 1 < side; ++y)
        for (std::uint32_t x = 0; x + 1 < side; ++x) {
            const std::uint32_t v = y * side + x;
            mesh.triangles.push_back({v, v + 1, v + side});
            mesh.triangles.push_back({v + 1, v + side + 1, v + side});
        }
    return mesh;
}

void write_packets(htvm::Encoder& encoder, std::ofstream& file) {
    while (const auto packet = encoder.pull()) {
        const auto bytes = htvm::write_packet(*packet);
        file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    auto options = htvm::default_options(htvm::Profile::tracked);
    options.quality = 60;
    options.key_interval = 60;
    auto encoder = htvm::Encoder::create(options);
    if (!encoder) return 1;
    std::ofstream file(argv[1], std::ios::binary);
    for (int frame = 0; frame < 4; ++frame) {
        if (const auto pushed = encoder->push(sheet(frame), nullptr, frame * 33333); !pushed) {
            std::cerr << pushed.error().message << "\n";
            return 1;
        }
        write_packets(*encoder, file);
    }
    encoder->finish();
    write_packets(*encoder, file);
    return file.flush() ? 0 : 1;
}
