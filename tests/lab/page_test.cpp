#include "page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace htvm::lab {

namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string base64_of(const std::string& text) {
    return base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(Base64, agrees_with_the_examples_of_rfc_4648) {
    EXPECT_EQ("", base64_of(""));
    EXPECT_EQ("Zg==", base64_of("f"));
    EXPECT_EQ("Zm8=", base64_of("fo"));
    EXPECT_EQ("Zm9v", base64_of("foo"));
    EXPECT_EQ("Zm9vYg==", base64_of("foob"));
    EXPECT_EQ("Zm9vYmE=", base64_of("fooba"));
    EXPECT_EQ("Zm9vYmFy", base64_of("foobar"));
    EXPECT_EQ("//79", base64_of("\xff\xfe\xfd"));
}

TEST(Escaped, leaves_no_character_that_html_reads) {
    EXPECT_EQ("a &lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;", escaped("a <b> & \"c\" 'd'"));
}

TEST(InlineSvg, drops_the_head_and_keeps_ids_apart) {
    const std::string svg =
        "<?xml version='1.0'?><svg><path id='p' d='M0,0'/><use xlink:href='#p' clip-path='url(#c)'/>"
        "<g id=\"q\"/></svg>";
    EXPECT_EQ("<svg><path id='f6_p' d='M0,0'/><use xlink:href='#f6_p' clip-path='url(#f6_c)'/><g id=\"f6_q\"/></svg>",
              inline_svg(svg, "f6_"));
    EXPECT_EQ("", inline_svg("no picture", "x"));
}

TEST(ReportPage, holds_its_words_escaped_and_nothing_from_elsewhere) {
    Report report;
    report.title = "A <capture>";
    report.summary = {"Fewer bits & more."};
    report.claims = {{"Rate", "1.6", "1.5", "holds", true}};
    report.figures = {{"20", "noise", "The paper says so.", {}, {}, {}, {}, "there is no skeleton."}};
    report.tables = {{"Rates", "A note.", {"Coder", "bpvf"}, {{"TFAN", "8.55"}}}};
    report.commands = {"htvm-lab reproduce 'a b' -o out"};
    const auto page = report_page(report);
    ASSERT_TRUE(page);
    for (const char* part : {"A &lt;capture&gt;", "Fewer bits &amp; more.", "class=\"yes\"", "Left out:",
                             "there is no skeleton.", "<td>8.55</td>", "prefers-color-scheme", "width=device-width"})
        EXPECT_THAT(*page, HasSubstr(part));
    EXPECT_THAT(*page, Not(HasSubstr("http")));
}

TEST(ReportPage, a_missing_chart_is_an_error) {
    Report report;
    report.figures = {{"6", "geometry", {}, {}, {}, {"no_such_chart.svg"}, {}, {}}};
    EXPECT_FALSE(report_page(report));
}

TEST(ProcValue, is_what_stands_behind_the_colon) {
    const std::string text = "processor\t: 0\nmodel name\t: A processor @ 3 GHz \nMemTotal:       16 kB\nempty:\n";
    EXPECT_EQ("A processor @ 3 GHz", proc_value(text, "model name"));
    EXPECT_EQ("16 kB", proc_value(text, "MemTotal"));
    EXPECT_EQ("", proc_value(text, "empty"));
    EXPECT_EQ("", proc_value(text, "none"));
}

}  // namespace
}  // namespace htvm::lab
