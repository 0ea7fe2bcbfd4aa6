// Tokens and links: what is let in, and what is not.
#include "live/server/credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace htvm::live {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using testing::HasSubstr;
using Time = std::chrono::system_clock::time_point;

class AccessFileTest : public testing::Test {
protected:
    void SetUp() override {
        auto name = (fs::temp_directory_path() / "htvm-access-XXXXXX").string();
        ASSERT_TRUE(mkdtemp(name.data()));
        folder = name;
        path = (folder / "file.json").string();
    }
    void TearDown() override { fs::remove_all(folder); }
    void write(const std::string& text) const { std::ofstream(path) << text; }
    std::string content() const {
        std::ifstream in(path);
        return {std::istreambuf_iterator<char>(in), {}};
    }

    fs::path folder;
    std::string path;
};
using PublishersFile = AccessFileTest;
using LinkKeysFile = AccessFileTest;

TEST_F(PublishersFile, ATokenLetsItsNameInAndNoOther) {
    const auto anna = add_publisher(path, "anna"), ben = add_publisher(path, "ben");
    ASSERT_TRUE(anna && ben);
    EXPECT_EQ(anna->size(), 64u);
    EXPECT_NE(*anna, *ben);
    const auto known = read_publishers(path);
    ASSERT_TRUE(known) << known.error().message;
    EXPECT_TRUE(may_publish(*known, "anna", *anna));
    EXPECT_TRUE(may_publish(*known, "ben", *ben));
    EXPECT_FALSE(may_publish(*known, "anna", *ben));
    EXPECT_FALSE(may_publish(*known, "nobody", *anna));
    EXPECT_FALSE(may_publish(*known, "anna", anna->substr(1)));
    EXPECT_FALSE(may_publish(*known, "anna", *anna + "0"));
    EXPECT_FALSE(may_publish(*known, "anna", ""));
    EXPECT_FALSE(may_publish(*known, "", ""));
}

TEST_F(PublishersFile, AnotherTokenReplacesTheOneBefore) {
    const auto first = add_publisher(path, "anna"), second = add_publisher(path, "anna");
    ASSERT_TRUE(first && second);
    const auto known = read_publishers(path);
    EXPECT_FALSE(may_publish(*known, "anna", *first));
    EXPECT_TRUE(may_publish(*known, "anna", *second));
}

TEST_F(PublishersFile, HoldsNoTokenAndIsItsOwnersAlone) {
    const auto token = add_publisher(path, "anna");
    EXPECT_THAT(content(), testing::Not(HasSubstr(*token)));
    struct stat status {};
    ASSERT_EQ(stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);  // nothing beside it
}

TEST_F(PublishersFile, NamesThatAreNoNamesOfStreamsAreRefused) {
    for (const char* name : {"", ".hidden", "..", "a/b", "a b", "a\n", "z\xc3\xbc"})
        EXPECT_FALSE(add_publisher(path, name)) << name;
    EXPECT_FALSE(add_publisher(path, std::string(65, 'a')));
    EXPECT_TRUE(add_publisher(path, std::string(64, 'a')));
}

TEST_F(PublishersFile, OneThatIsDamagedIsRefusedAndNotReplaced) {
    const std::string zeros(32, '0');
    for (const auto& text : std::vector<std::string>{
             "", "[]", "{\"anna\": 1}", "{\"anna\": {\"salt\": \"00\", \"hash\": \"00\"}}",
             "{\"a/b\": {\"salt\": \"" + zeros + "\", \"hash\": \"" + zeros + zeros + "\"}}", "{\"anna\": {}}"}) {
        write(text);
        EXPECT_FALSE(read_publishers(path)) << text;
        EXPECT_FALSE(add_publisher(path, "ben")) << text;
        EXPECT_EQ(content(), text);
    }
    EXPECT_THAT(read_publishers((folder / "none").string()).error().message, HasSubstr("No such file"));
    EXPECT_THAT(add_publisher((folder / "none" / "file").string(), "anna").error().message, HasSubstr("No such file"));
}

TEST(BearerToken, IsWhatFollowsTheScheme) {
    EXPECT_EQ(bearer_token("Bearer abc"), "abc");
    EXPECT_EQ(bearer_token("bearer  abc"), "abc");
    EXPECT_EQ(bearer_token("Bearer "), "");
    EXPECT_EQ(bearer_token("Bearer"), "");
    EXPECT_EQ(bearer_token("Basic abc"), "");
    EXPECT_EQ(bearer_token(""), "");
}

TEST(LinkSignature, IsHmacSha256OfPathExpiryAndKeyNumber) {
    // Computed by Python: hmac.new(bytes(32), b"htvm link\nwatch/anna\n1000\n7", "sha256").hexdigest()
    EXPECT_EQ(link_query({{7, LinkKey{}}}, "watch/anna", Time(seconds(1000))),
              "expires=1000&key=7&signature=57a165662c0526a0f86ff92e1cc28b199f49ecac3148eddad5f1e3c59f734789");
}

TEST(LinkSignature, LetsInToItsPathUntilItExpires) {
    const LinkKeys keys = {{1, LinkKey{1}}};
    const auto target = "/watch/anna?" + link_query(keys, "watch/anna", Time(seconds(1000)));
    EXPECT_EQ(check_link(keys, "watch/anna", target, Time(seconds(999))), LinkCheck::good);
    EXPECT_EQ(check_link(keys, "watch/anna", target + "&stamps", Time(seconds(999))), LinkCheck::good);
    EXPECT_EQ(check_link(keys, "watch/anna", target, Time(seconds(1000))), LinkCheck::expired);
    EXPECT_EQ(check_link(keys, "watch/ben", target, Time(seconds(999))), LinkCheck::forged);
    EXPECT_EQ(check_link(keys, "files/anna", target, Time(seconds(999))), LinkCheck::forged);
    EXPECT_EQ(check_link(keys, "watch/anna", "/watch/anna", Time(seconds(999))), LinkCheck::missing);
}

TEST(LinkSignature, WhateverIsChangedMakesItForged) {
    const LinkKeys keys = {{1, LinkKey{1}}, {2, LinkKey{2}}};
    const auto target = "/watch/anna?" + link_query(keys, "watch/anna", Time(seconds(1000)));
    const auto changed = [&](const std::string& from, const std::string& to) {
        auto text = target;
        text.replace(text.find(from), from.size(), to);
        return check_link(keys, "watch/anna", text, Time(seconds(999)));
    };
    EXPECT_EQ(changed("expires=1000", "expires=2000"), LinkCheck::forged);
    EXPECT_EQ(changed("expires=1000", "expires=99999999999999999999999"), LinkCheck::forged);
    EXPECT_EQ(changed("expires=1000", "expires=-1"), LinkCheck::forged);
    EXPECT_EQ(changed("expires=1000&", ""), LinkCheck::forged);
    EXPECT_EQ(changed("key=2", "key=1"), LinkCheck::forged);
    EXPECT_EQ(changed("key=2", "key=3"), LinkCheck::forged);
    EXPECT_EQ(changed("key=2", "key=4294967298"), LinkCheck::forged);  // 2^32 + 2
    EXPECT_EQ(changed("signature=", "signature=00"), LinkCheck::forged);
    EXPECT_EQ(changed("signature=", "signature="), LinkCheck::good);
    auto cut = target;
    cut.pop_back();
    EXPECT_EQ(check_link(keys, "watch/anna", cut, Time(seconds(999))), LinkCheck::forged);
    const auto last = target.back();
    cut += last == '0' ? '1' : '0';
    EXPECT_EQ(check_link(keys, "watch/anna", cut, Time(seconds(999))), LinkCheck::forged);
}

TEST_F(LinkKeysFile, LinksByTheKeyBeforeTheNewestStayGood) {
    const auto now = Time(seconds(999));
    const auto added_and_link = [&](std::uint32_t expected) {
        EXPECT_EQ(add_link_key(path).value(), expected);
        return "?" + link_query(read_link_keys(path).value(), "watch/anna", Time(seconds(1000)));
    };
    const auto first = added_and_link(1), second = added_and_link(2);
    EXPECT_EQ(check_link(read_link_keys(path).value(), "watch/anna", first, now), LinkCheck::good);
    EXPECT_EQ(check_link(read_link_keys(path).value(), "watch/anna", second, now), LinkCheck::good);
    const auto third = added_and_link(3);
    EXPECT_EQ(check_link(read_link_keys(path).value(), "watch/anna", first, now), LinkCheck::forged);
    EXPECT_EQ(check_link(read_link_keys(path).value(), "watch/anna", second, now), LinkCheck::good);
    EXPECT_EQ(check_link(read_link_keys(path).value(), "watch/anna", third, now), LinkCheck::good);
}

TEST_F(LinkKeysFile, OneThatIsDamagedIsRefused) {
    const auto key = '"' + std::string(64, 'a') + '"';
    write("{\"1\": " + key + "}");
    EXPECT_TRUE(read_link_keys(path));
    for (const auto& text : std::vector<std::string>{"", "{}", "[]", "{\"1\": \"aa\"}", "{\"one\": " + key + "}",
                                                     "{\"4294967296\": " + key + "}",
                                                     "{\"1\": " + key + ", \"2\": " + key + ", \"3\": " + key + "}"}) {
        write(text);
        EXPECT_FALSE(read_link_keys(path)) << text;
    }
}

}  // namespace
}  // namespace htvm::live
