// What is parsed of a request: no path leads out of the folder, and ranges are those of RFC 9110.
#include "live/files/http_request.h"

#include <gtest/gtest.h>

namespace htvm::live {
namespace {

using Segments = std::vector<std::string>;

TEST(PathSegments, AreDecoded) {
    EXPECT_EQ(path_segments("/"), Segments{});
    EXPECT_EQ(path_segments("/files/a%20person.htvm?x=/../y#z"), (Segments{"files", "a person.htvm"}));
    EXPECT_EQ(path_segments("/files/M%C3%BCller/"), (Segments{"files", "Müller"}));
}

TEST(PathSegments, NeverLeadUpwardsOrToHiddenFiles) {
    for (const char* target : {"/..",
                               "/../etc/passwd",
                               "/files/../../etc/passwd",
                               "/files/%2e%2e/x",
                               "/files/%2E./x",
                               "/files/.hidden",
                               "/files/./x",
                               "/files//x",
                               "//x",
                               "/files/a%2fb",
                               "/files/a%2Fb",
                               "/files/a\\..\\b",
                               "/files/%5c..",
                               "/files/%00",
                               "/files/a%0ab",
                               "/files/%7f",
                               "/files/%",
                               "/files/%4",
                               "/files/%zz",
                               "/files/%-1",
                               "/files/% 1",
                               "",
                               "files",
                               "http://elsewhere/files/x",
                               "*"})
        EXPECT_EQ(path_segments(target), std::nullopt) << target;
}

TEST(PathSegments, AreFewAndShort) {
    std::string deep;
    for (int i = 0; i < 16; ++i) deep += "/a";
    EXPECT_TRUE(path_segments(deep));
    EXPECT_FALSE(path_segments(deep + "/a"));
    EXPECT_TRUE(path_segments('/' + std::string(1000, 'a')));
    EXPECT_FALSE(path_segments('/' + std::string(1024, 'a')));
}

void expect_part(const char* range, std::uint64_t size, std::uint64_t first, std::uint64_t count) {
    const auto part = requested_part(range, size);
    EXPECT_EQ(part.kind, FilePart::Kind::part) << range;
    EXPECT_EQ(part.first, first) << range;
    EXPECT_EQ(part.count, count) << range;
}

TEST(RequestedPart, IsCutToTheFile) {
    expect_part("bytes=0-262143", 1000, 0, 1000);
    expect_part("bytes=10-19", 1000, 10, 10);
    expect_part("bytes=999-999", 1000, 999, 1);
    expect_part("bytes=990-", 1000, 990, 10);
    expect_part("bytes=-10", 1000, 990, 10);
    expect_part("bytes=-5000", 1000, 0, 1000);
    expect_part("bytes=0-18446744073709551615", 1000, 0, 1000);
}

TEST(RequestedPart, BeyondTheFileCannotBeGiven) {
    for (const char* range : {"bytes=1000-", "bytes=1000-1001", "bytes=-0", "bytes=18446744073709551615-"})
        EXPECT_EQ(requested_part(range, 1000).kind, FilePart::Kind::beyond) << range;
    for (const char* range : {"bytes=0-", "bytes=-1"})
        EXPECT_EQ(requested_part(range, 0).kind, FilePart::Kind::beyond) << range;
}

TEST(RequestedPart, IsTheWholeFileIfTheHeaderSaysNothingClear) {
    for (const char* range :
         {"", "bytes=", "bytes=-", "bytes=a-b", "bytes=5", "bytes=9-5", "bytes=0-1,5-6", "lines=0-5", "bytes=-1-5",
          "bytes=0-99999999999999999999", "bytes=+1-5", "bytes 0-5", "bytes=0x1-5", "bytes=1-5x", "bytes=--5"}) {
        const auto part = requested_part(range, 1000);
        EXPECT_EQ(part.kind, FilePart::Kind::whole) << range;
        EXPECT_EQ(part.count, 1000u) << range;
    }
}

TEST(NamesTag, FindsItInAListWeakOrNot) {
    for (const char* list : {"\"a\"", "*", "\"b\", \"a\"", "W/\"a\"", " \"b\" ,W/\"a\" "})
        EXPECT_TRUE(names_tag(list, "\"a\"")) << list;
    for (const char* list : {"", "\"b\"", "a", "\"ab\"", ","}) EXPECT_FALSE(names_tag(list, "\"a\"")) << list;
}

TEST(AcceptsGzip, IfItIsNamedAndNotRefused) {
    for (const char* header : {"gzip", "br, gzip", "gzip;q=0.5", "deflate , gzip ; q=1"})
        EXPECT_TRUE(accepts_gzip(header)) << header;
    for (const char* header : {"", "br", "gzip;q=0", "gzip; q=0.0", "xgzip"})
        EXPECT_FALSE(accepts_gzip(header)) << header;
}

TEST(HttpRequest, TheHostOfAnOriginIsWhatFollowsItsScheme) {
    EXPECT_EQ(host_of_origin("https://a.example:8080"), "a.example:8080");
    EXPECT_EQ(host_of_origin("http://[::1]"), "[::1]");
    EXPECT_EQ(host_of_origin("null"), "");
    EXPECT_EQ(host_of_origin(""), "");
    EXPECT_EQ(host_of_origin("://"), "");
}

TEST(HttpRequestTest, MembersOfAQuery) {
    EXPECT_EQ(query_value("/watch/anna?key=2&stamps", "key"), "2");
    EXPECT_EQ(query_value("/watch/anna?key=2&stamps", "stamps"), "");
    EXPECT_EQ(query_value("/watch/anna?token=a%2Fb%3D=c#key=1", "token"), "a/b==c");
    EXPECT_EQ(query_value("/a?b=1&b=2", "b"), "1");
    for (const char* target : {"/watch/key", "/watch/anna?", "/a?monkey=1", "/a?key=%0a", "/a?key=%1", "/a#?key=1"})
        EXPECT_EQ(query_value(target, "key"), std::nullopt) << target;
}

}  // namespace
}  // namespace htvm::live
