#include <gtest/gtest.h>

#include <random>

#include "entropy/cost.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

TEST(RangeCoder, NothingCodedTakesNoBytes) {
    RangeEncoder encoder;
    EXPECT_TRUE(encoder.finish().empty());
}

TEST(RangeCoder, EverySymbolKindComesBackInAnyMixture) {
    for (unsigned seed = 0; seed < 50; ++seed) {
        std::mt19937 random(seed);
        struct Item {
            int kind;
            std::uint32_t value;
            int bits;
        };
        std::vector<Item> items(random() % 3000);
        const int skew = static_cast<int>(random() % 12);
        for (auto& item : items) {
            item.kind = static_cast<int>(random() % 5);
            item.bits = 1 + static_cast<int>(random() % 32);
            item.value = static_cast<std::uint32_t>(random()) >> (random() % 32);
            if (item.kind == 0) item.value = random() % 12 <= static_cast<unsigned>(skew);
            if (item.kind == 1) item.value %= 100;
            if (item.kind == 2) item.value = item.value == 0xFFFFFFFFu ? 0 : item.value;
            if (item.kind == 3 && item.value == 0x80000000u) item.value = 0;
            if (item.kind == 4 && item.bits < 32) item.value &= (1u << item.bits) - 1;
        }
        BinaryModel binary;
        auto symbol = SymbolModel::for_alphabet(100);
        UnsignedModel whole;
        SignedModel either;
        RangeEncoder encoder;
        for (const auto& item : items) {
            if (item.kind == 0) encoder.bit(binary, item.value);
            if (item.kind == 1) encode_symbol(encoder, symbol, item.value);
            if (item.kind == 2) encode_unsigned(encoder, whole, item.value);
            if (item.kind == 3) encode_signed(encoder, either, static_cast<std::int32_t>(item.value));
            if (item.kind == 4) encoder.raw(item.value, item.bits);
        }
        const auto bytes = encoder.finish();
        binary = {};
        symbol = SymbolModel::for_alphabet(100);
        whole = {};
        either = {};
        RangeDecoder decoder(bytes);
        for (const auto& item : items) {
            std::uint32_t got = 0;
            if (item.kind == 0) got = decoder.bit(binary);
            if (item.kind == 1) got = decode_symbol(decoder, symbol);
            if (item.kind == 2) got = decode_unsigned(decoder, whole);
            if (item.kind == 3) got = static_cast<std::uint32_t>(decode_signed(decoder, either));
            if (item.kind == 4) got = decoder.raw(item.bits);
            ASSERT_EQ(got, item.value) << "kind " << item.kind << " seed " << seed;
        }
        EXPECT_FALSE(decoder.exhausted());
    }
}

TEST(RangeCoder, ALongRunOfOneValueCostsAlmostNothing) {
    RangeEncoder encoder;
    BinaryModel model;
    for (int i = 0; i < 100000; ++i) encoder.bit(model, true);
    const auto bytes = encoder.finish();
    EXPECT_LT(bytes.size(), 100000 / 8 / 50);
    RangeDecoder decoder(bytes);
    model = {};
    for (int i = 0; i < 100000; ++i) ASSERT_TRUE(decoder.bit(model));
    EXPECT_FALSE(decoder.exhausted());
}

TEST(RangeCoder, ADecoderWithoutEnoughBytesSaysSo) {
    std::mt19937 random(1);
    RangeEncoder encoder;
    for (int i = 0; i < 1000; ++i) encoder.raw(static_cast<std::uint32_t>(random()), 8);
    auto bytes = encoder.finish();
    bytes.resize(bytes.size() / 2);
    RangeDecoder decoder(bytes);
    for (int i = 0; i < 1000; ++i) decoder.raw(8);
    EXPECT_TRUE(decoder.exhausted());
}

TEST(RangeCoder, ADecoderThatIsToldWhereItsRunEndsReadsZerosBehindIt) {
    RangeEncoder encoder;
    for (std::uint32_t i = 0; i < 20; ++i) encoder.raw(i < 8 ? i : 0, 8);
    auto bytes = encoder.finish();
    const auto end = bytes.size();
    bytes.insert(bytes.end(), 40, 0xAB);
    RangeDecoder decoder(bytes);
    EXPECT_EQ(decoder.raw(8), 0u);
    EXPECT_FALSE(decoder.end_at(4));
    ASSERT_TRUE(decoder.end_at(end));
    for (std::uint32_t i = 1; i < 20; ++i) EXPECT_EQ(decoder.raw(8), i < 8 ? i : 0);
}

TEST(RangeCoder, BothSidesSayWhereInTheRunTheyAreAndThatIsWhatTheDecisionsSoFarTake) {
    std::mt19937 random(5);
    for (int skew : {2, 20, 2000}) {
        RangeEncoder encoder;
        CostCounter counter;
        BinaryModel model, counted, decoded;
        std::vector<bool> bits;
        std::vector<std::size_t> positions;
        for (int i = 0; i < 4000; ++i) {
            bits.push_back(random() % static_cast<unsigned>(skew) == 0);
            encoder.bit(model, bits.back());
            counter.bit(counted, bits.back());
            if (i % 7 == 0) encoder.raw(static_cast<std::uint32_t>(i) & 63, 6), counter.raw(0, 6);
            positions.push_back(encoder.position());
            ASSERT_NEAR(static_cast<double>(positions.back()), counter.bits() / 8, 1 + 0.01 * counter.bits() / 8);
        }
        const auto bytes = encoder.finish();
        EXPECT_LE(positions.back(), bytes.size() + 4);
        RangeDecoder decoder(bytes);
        EXPECT_EQ(decoder.position(), 0u);
        for (std::size_t i = 0; i < bits.size(); ++i) {
            ASSERT_EQ(decoder.bit(decoded), bits[i]);
            if (i % 7 == 0) decoder.raw(6);
            ASSERT_EQ(decoder.position(), positions[i]);
        }
    }
}

TEST(CostCounter, AgreesWithTheEncoderWithinOnePercent) {
    std::mt19937 random(7);
    std::geometric_distribution<int> values(0.2);
    RangeEncoder encoder;
    CostCounter counter;
    UnsignedModel encoder_model, counter_model;
    for (int i = 0; i < 20000; ++i) {
        const auto value = static_cast<std::uint32_t>(values(random));
        encode_unsigned(encoder, encoder_model, value);
        encode_unsigned(counter, counter_model, value);
    }
    EXPECT_NEAR(counter.bits() / (8.0 * static_cast<double>(encoder.finish().size())), 1.0, 0.01);
}

TEST(BinaryModel, LearnsASkewedSourceToWithinTwoPercentOfItsEntropy) {
    std::mt19937 random(3);
    CostCounter counter;
    BinaryModel model;
    const int n = 50000;
    for (int i = 0; i < n; ++i) counter.bit(model, random() % 10 == 0);
    EXPECT_LT(counter.bits() / n, 0.469 * 1.02);
}

}  // namespace
}  // namespace htvm::internal
