#include "codec/format/sequence.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "codec/hostile_bytes.h"
#include "core/bytes.h"

namespace htvm::internal {
namespace {

SequenceHeader full_header() {
    SequenceHeader header;
    header.lattice = {.origin = {-2000000000, 7, 2000000000}, .bits = 16};
    header.fps_numerator = 30000;
    header.fps_denominator = 1001;
    header.unit_micrometres = 1000000;
    header.has_skeleton = false;
    header.skeleton.joint_names = {"hip", "", "a name with blanks, commas and \xc3\xbc", std::string(255, 'x')};
    header.skeleton.bones = {{0, 1}, {3, 2}, {1, 1}};
    header.radii = {0, 1234, lattice_limit};
    header.nearest_vertices = 64;
    header.weight_width = lattice_limit;
    header.node_spacing = 1280;
    header.session = ~0ull;
    header.up = UpAxis::minus_z;
    header.floor = -lattice_limit;
    header.metadata = {
        {"title", "\xe4\xba\xba \xf0\x9f\x9a\xb6"}, {"rights", ""}, {std::string(255, 'k'), std::string(4095, 'v')}};
    header.global_shift = {-most_global_shift, 0, most_global_shift};
    return header;
}

void expect_equal(const SequenceHeader& a, const SequenceHeader& b) {
    EXPECT_EQ(a.lattice.origin, b.lattice.origin);
    EXPECT_EQ(a.lattice.bits, b.lattice.bits);
    EXPECT_EQ(a.fps_numerator, b.fps_numerator);
    EXPECT_EQ(a.fps_denominator, b.fps_denominator);
    EXPECT_EQ(a.unit_micrometres, b.unit_micrometres);
    EXPECT_EQ(a.has_skeleton, b.has_skeleton);
    EXPECT_EQ(a.skeleton.joint_names, b.skeleton.joint_names);
    EXPECT_EQ(a.radii, b.radii);
    EXPECT_EQ(a.nearest_vertices, b.nearest_vertices);
    EXPECT_EQ(a.weight_width, b.weight_width);
    EXPECT_EQ(a.node_spacing, b.node_spacing);
    EXPECT_EQ(a.session, b.session);
    EXPECT_EQ(a.up, b.up);
    EXPECT_EQ(a.floor, b.floor);
    EXPECT_EQ(a.metadata, b.metadata);
    EXPECT_EQ(a.global_shift, b.global_shift);
    ASSERT_EQ(a.skeleton.bones.size(), b.skeleton.bones.size());
    for (std::size_t i = 0; i < a.skeleton.bones.size(); ++i) {
        EXPECT_EQ(a.skeleton.bones[i].first, b.skeleton.bones[i].first);
        EXPECT_EQ(a.skeleton.bones[i].second, b.skeleton.bones[i].second);
    }
}

void expect_refused(const SequenceHeader& header, const char* why) {
    const auto read = read_sequence_header(write_sequence_header(header));
    ASSERT_FALSE(read.has_value()) << why;
    EXPECT_EQ(read.error().kind, ErrorKind::corrupt_stream) << why;
}

TEST(SequenceHeader, ComesBack) {
    const auto header = full_header();
    const auto read = read_sequence_header(write_sequence_header(header));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    expect_equal(*read, header);
}

TEST(SequenceHeader, OfTheLargestSkeletonComesBack) {
    auto header = full_header();
    header.skeleton.joint_names.assign(1024, "joint");
    header.skeleton.bones.assign(1024, {1023, 0});
    header.radii.assign(1024, 5);
    const auto read = read_sequence_header(write_sequence_header(header));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    expect_equal(*read, header);
}

TEST(SequenceHeader, WrittenAgainIsTheSameBytes) {
    const auto bytes = write_sequence_header(full_header());
    EXPECT_EQ(write_sequence_header(*read_sequence_header(bytes)), bytes);
}

TEST(SequenceHeader, TheGlobalShiftStandsLastWhereDecodersThatDoNotKnowItStopReading) {
    auto shifted = full_header(), plain = full_header();
    plain.global_shift = {};
    const auto bytes = write_sequence_header(shifted), without = write_sequence_header(plain);
    ASSERT_EQ(bytes.size(), without.size() + 24);
    std::size_t differing = 0;
    for (std::size_t i = 0; i < without.size(); ++i) differing += bytes[i] != without[i];
    EXPECT_EQ(differing, 1u) << "the bit that says that it follows";
    const auto cut = read_sequence_header(std::span(bytes).first(bytes.size() - 1));
    EXPECT_FALSE(cut) << "once said, it has to be there";
}

TEST(SequenceHeader, LongNamesAreCut) {
    auto header = full_header();
    header.skeleton.joint_names[0] = std::string(300, 'y');
    EXPECT_EQ(read_sequence_header(write_sequence_header(header))->skeleton.joint_names[0], std::string(255, 'y'));
}

TEST(SequenceHeader, FieldsOutOfRangeAreRefused) {
    auto header = full_header();
    header.lattice.bits = 17;
    expect_refused(header, "lattice bits");
    header = full_header();
    header.fps_numerator = 0;
    expect_refused(header, "frame rate");
    header = full_header();
    header.fps_denominator = 0;
    expect_refused(header, "frame rate");
    header = full_header();
    header.unit_micrometres = 0;
    expect_refused(header, "unit");
    header = full_header();
    header.nearest_vertices = 0;
    expect_refused(header, "no nearest vertices");
    header = full_header();
    header.nearest_vertices = mtfan_max_nearest + 1;
    expect_refused(header, "too many nearest vertices");
    header = full_header();
    header.weight_width = lattice_limit + 1;
    expect_refused(header, "weight width");
    header = full_header();
    header.weight_width = -1;
    expect_refused(header, "negative weight width");
    header = full_header();
    header.skeleton.bones.clear();
    expect_refused(header, "no bones");
    header = full_header();
    header.skeleton.bones[1].second = 4;
    expect_refused(header, "a bone to a joint that is not there");
    header = full_header();
    header.radii[0] = lattice_limit + 1;
    expect_refused(header, "radius");
    header = full_header();
    header.radii[0] = -1;
    expect_refused(header, "negative radius");
    header = full_header();
    header.up = static_cast<UpAxis>(7);
    expect_refused(header, "an axis that is none");
    header = full_header();
    header.floor = lattice_limit + 1;
    expect_refused(header, "floor");
    header = full_header();
    header.up = UpAxis::unknown;
    expect_refused(header, "a floor, and nothing that is up");
    header = full_header();
    header.global_shift[1] = most_global_shift + 1;
    expect_refused(header, "global shift");
}

TEST(SequenceHeader, MetadataIsBoundedTextInUtf8) {
    const auto with = [](std::vector<MetadataEntry> metadata) {
        auto header = full_header();
        header.metadata = std::move(metadata);
        return header;
    };
    expect_refused(with({{"", "no key"}}), "no key");
    expect_refused(with({{"k", std::string(4096, 'v')}}), "a long value");
    expect_refused(with(std::vector<MetadataEntry>(5, {"k", std::string(4000, 'v')})), "too much of it all");
    for (const std::string wrong :
         {"\x80", "\xc3", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xf8\x88\x80\x80\x80"}) {
        expect_refused(with({{"k", wrong}}), "not UTF-8");
        expect_refused(with({{wrong, "v"}}), "not UTF-8");
    }
    expect_refused(with({{"k", std::string("a\0b", 3)}}), "a zero within");
    const auto most = with(std::vector<MetadataEntry>(255, {"k", "v"}));
    expect_equal(*read_sequence_header(write_sequence_header(most)), most);
}

// A header as version 1 wrote it, which ended with the spacing of the nodes, or before it.
std::vector<std::uint8_t> header_of_version_1(bool with_spacing) {
    auto header = full_header();
    header.floor.reset();
    header.global_shift = {};
    header.metadata.clear();
    auto bytes = write_sequence_header(header);
    bytes[4] = 1;
    bytes.resize(bytes.size() - 10 - (with_spacing ? 0 : 4));
    return bytes;
}

TEST(SequenceHeader, OfVersion1IsRead) {
    for (const bool with_spacing : {false, true}) {
        auto bytes = header_of_version_1(with_spacing);
        if (!with_spacing) bytes.insert(bytes.end(), 3, 0xFF);  // what is no whole field is ignored
        const auto read = read_sequence_header(bytes);
        ASSERT_TRUE(read.has_value()) << read.error().message;
        EXPECT_EQ(read->version, 1);
        EXPECT_EQ(read->node_spacing, with_spacing ? 1280 : 0);
        EXPECT_EQ(read->session, 0u);
        EXPECT_EQ(read->up, UpAxis::unknown);
        EXPECT_TRUE(read->metadata.empty());
    }
}

TEST(SequenceHeader, BytesBehindTheLastFieldAreIgnored) {
    auto bytes = write_sequence_header(full_header());
    bytes.insert(bytes.end(), 5, 0xFF);
    expect_equal(*read_sequence_header(bytes), full_header());
}

TEST(SequenceHeader, AnotherVersionIsUnsupported) {
    auto bytes = write_sequence_header(full_header());
    bytes[4] = static_cast<std::uint8_t>(newest_version + 1);
    const auto read = read_sequence_header(bytes);
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().kind, ErrorKind::unsupported);
    EXPECT_NE(read.error().message.find("version 9"), std::string::npos) << read.error().message;
    EXPECT_NE(read.error().message.find("versions 1 to 8; a newer htvm"), std::string::npos) << read.error().message;
    bytes[4] = 0;
    EXPECT_EQ(read_sequence_header(bytes).error().kind, ErrorKind::unsupported);
    bytes[0] = 'x';
    EXPECT_EQ(read_sequence_header(bytes).error().kind, ErrorKind::corrupt_stream) << "not this format at all";
}

TEST(SequenceHeader, EveryTruncationIsAnError) {
    const auto bytes = write_sequence_header(full_header());
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(read_sequence_header(std::span(bytes).first(size)).has_value()) << size;
}

TEST(SequenceHeader, DamageGivesAnErrorOrAHeaderInRange) {
    hostile::try_everything(
        write_sequence_header(full_header()),
        [](const std::vector<std::uint8_t>& bytes) {
            const auto read = read_sequence_header(bytes);
            if (!read) return;
            EXPECT_LE(read->lattice.bits, 16);
            EXPECT_GE(read->nearest_vertices, 1);
            EXPECT_FALSE(read->skeleton.bones.empty());
            EXPECT_EQ(read->radii.size(), read->skeleton.bones.size());
            for (const auto& bone : read->skeleton.bones)
                EXPECT_LT(std::max(bone.first, bone.second), read->skeleton.joint_names.size());
        },
        4000);
}

void expect_comes_back(const std::vector<IndexEntry>& entries) {
    const auto read = read_sequence_index(write_sequence_index(entries));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(*read, entries);
}

std::vector<IndexEntry> thousand() {
    std::vector<IndexEntry> entries;
    for (std::uint32_t i = 0; i < 1000; ++i)
        entries.push_back({30 * i, -5 + 1000000 * std::int64_t{i}, 90 + 123456 * i});
    return entries;
}

TEST(SequenceIndex, ComesBack) {
    expect_comes_back({});
    expect_comes_back({{0, 0, 0}});
    expect_comes_back(thousand());
}

TEST(SequenceIndex, ExtremesComeBack) {
    constexpr auto low = std::numeric_limits<std::int64_t>::min(), high = std::numeric_limits<std::int64_t>::max();
    expect_comes_back({{0, low, 0}, {1, high, 1}, {~0u, high, ~0ull}});
    expect_comes_back({{5, high, 7}, {6, low, 8}, {7, -1, 9}});
}

TEST(SequenceIndex, ACountThatTheBytesCannotHoldIsAnError) {
    ByteWriter out;
    out.varint(~0ull);
    out.varint(1);
    const auto read = read_sequence_index(out.data());
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().kind, ErrorKind::corrupt_stream);
}

TEST(SequenceIndex, DamageIsSurvived) {
    hostile::try_everything(write_sequence_index(thousand()), [](const std::vector<std::uint8_t>& bytes) {
        const auto read = read_sequence_index(bytes);
        EXPECT_TRUE(!read || read->size() <= bytes.size());
    });
}

}  // namespace
}  // namespace htvm::internal
