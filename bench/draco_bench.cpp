// The static coder that people would use instead, on the same meshes in the same run: libdraco at compression levels 10
// and 7, positions at 11 bits (a cell of about a millimetre on a person), colours at 8.
#include <benchmark/benchmark.h>
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include <cstdlib>

#include "captures.h"

namespace {

void fill(draco::Mesh& out, const htvm::Mesh& mesh) {
    out.set_num_points(static_cast<std::uint32_t>(mesh.positions.size()));
    const auto add = [&](draco::GeometryAttribute::Type type, draco::DataType data_type, const auto& values) {
        draco::GeometryAttribute attribute;
        attribute.Init(type, nullptr, 3, data_type, false, sizeof(values[0]), 0);
        const int id = out.AddAttribute(attribute, true, static_cast<std::uint32_t>(values.size()));
        for (std::uint32_t i = 0; i < values.size(); ++i)
            out.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[i]);
    };
    add(draco::GeometryAttribute::POSITION, draco::DT_FLOAT32, mesh.positions);
    if (!mesh.colours.empty()) add(draco::GeometryAttribute::COLOR, draco::DT_UINT8, mesh.colours);
    for (const auto& t : mesh.triangles)
        out.AddFace({draco::PointIndex(t[0]), draco::PointIndex(t[1]), draco::PointIndex(t[2])});
}

void encode_to(const htvm::Mesh& mesh, std::int64_t level, draco::EncoderBuffer& buffer) {
    draco::Mesh packed;
    fill(packed, mesh);
    draco::Encoder encoder;
    const int speed = 10 - static_cast<int>(level);
    encoder.SetSpeedOptions(speed, speed);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 11);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::COLOR, 8);
    buffer.Clear();
    if (!encoder.EncodeMeshToBuffer(packed, &buffer).ok()) std::abort();
}

void report(benchmark::State& state, const htvm::Mesh& mesh, const draco::EncoderBuffer& buffer) {
    state.counters["fps"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
    state.counters["captured vertices"] = static_cast<double>(mesh.positions.size());
    state.counters["Mbit/s at 30 fps"] = 8 * 30e-6 * static_cast<double>(buffer.size());
}

void encode_draco(benchmark::State& state) {
    const auto& mesh = htvm::bench::whole_capture().frame(1);
    draco::EncoderBuffer buffer;
    for (auto _ : state) encode_to(mesh, state.range(0), buffer);
    report(state, mesh, buffer);
}

void decode_draco(benchmark::State& state) {
    const auto& mesh = htvm::bench::whole_capture().frame(1);
    draco::EncoderBuffer coded;
    encode_to(mesh, state.range(0), coded);
    for (auto _ : state) {
        draco::DecoderBuffer buffer;
        buffer.Init(coded.data(), coded.size());
        draco::Decoder decoder;
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        if (!decoded.ok()) std::abort();
        benchmark::DoNotOptimize(decoded.value()->num_points());
    }
    report(state, mesh, coded);
}

void levels(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgName("level")->Arg(10)->Arg(7)->Unit(benchmark::kMillisecond)->UseRealTime();
}

BENCHMARK(encode_draco)->Apply(levels);
BENCHMARK(decode_draco)->Apply(levels);

}  // namespace
