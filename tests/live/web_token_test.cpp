// Tokens that others sign: what is let in, and what is not.
#include "live/server/web_token.h"

#include <gtest/gtest.h>
#include <openssl/bn.h>
#include <openssl/core_names.h>
#include <openssl/ecdsa.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/pem.h>
#include <openssl/rsa.h>

#include <array>
#include <filesystem>
#include <fstream>

namespace htvm::live {
namespace {

namespace fs = std::filesystem;
using Time = std::chrono::system_clock::time_point;
using std::chrono::seconds;
using Key = std::shared_ptr<EVP_PKEY>;

std::string base64(std::string_view bytes) {
    constexpr const char* alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    std::string out;
    unsigned bits = 0, count = 0;
    for (const char c : bytes) {
        bits = bits << 8 | static_cast<unsigned char>(c);
        for (count += 8; count >= 6; count -= 6) out += alphabet[bits >> (count - 6) & 63];
    }
    if (count > 0) out += alphabet[bits << (6 - count) & 63];
    return out;
}

Key rsa_of(unsigned bits) { return {EVP_RSA_gen(bits), EVP_PKEY_free}; }
Key curve(const char* name) { return {EVP_EC_gen(name), EVP_PKEY_free}; }

std::string signature(const Key& key, const std::string& text) {
    EVP_MD_CTX* context = EVP_MD_CTX_new();
    std::array<unsigned char, 1100> out{};
    std::size_t size = out.size();
    EXPECT_EQ(EVP_DigestSignInit(context, nullptr, EVP_sha256(), nullptr, key.get()), 1);
    EXPECT_EQ(
        EVP_DigestSign(context, out.data(), &size, reinterpret_cast<const unsigned char*>(text.data()), text.size()),
        1);
    EVP_MD_CTX_free(context);
    if (EVP_PKEY_is_a(key.get(), "RSA")) return {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size)};
    const unsigned char* der = out.data();
    ECDSA_SIG* made = d2i_ECDSA_SIG(nullptr, &der, static_cast<long>(size));
    std::array<unsigned char, 64> raw{};
    BN_bn2binpad(ECDSA_SIG_get0_r(made), raw.data(), 32);
    BN_bn2binpad(ECDSA_SIG_get0_s(made), raw.data() + 32, 32);
    ECDSA_SIG_free(made);
    return {raw.begin(), raw.end()};
}

std::string token(const Key& key, const std::string& header, const std::string& claims) {
    const auto text = base64(header) + '.' + base64(claims);
    return text + '.' + base64(signature(key, text));
}

std::string number_of(const Key& key, const char* name) {
    BIGNUM* number = nullptr;
    EXPECT_EQ(EVP_PKEY_get_bn_param(key.get(), name, &number), 1);
    std::string out(static_cast<std::size_t>(BN_num_bytes(number)), '\0');
    BN_bn2bin(number, reinterpret_cast<unsigned char*>(out.data()));
    BN_free(number);
    return base64(out);
}

std::string pem_of(const Key& key) {
    BIO* bio = BIO_new(BIO_s_mem());
    PEM_write_bio_PUBKEY(bio, key.get());
    char* text = nullptr;
    const auto size = BIO_get_mem_data(bio, &text);
    std::string out(text, static_cast<std::size_t>(size));
    BIO_free(bio);
    return out;
}

const std::string rs256 = R"({"alg":"RS256"})", es256 = R"({"alg":"ES256"})",
                  anna = R"({"exp":1000,"publish":"anna","watch":["anna","ben"]})";

class WebTokenTest : public testing::Test {
protected:
    static void SetUpTestSuite() {
        rsa = rsa_of(2048);
        p256 = curve("P-256");
    }
    static void TearDownTestSuite() {
        rsa.reset();
        p256.reset();
    }
    // Which part of the work a token does at second 999.
    static WebTokenCheck check(const std::string& text, const std::string& action = "watch",
                               const std::string& stream = "anna", const std::string& audience = "", int at = 999) {
        const WebTokenKeys keys = {{WebTokenAlgorithm::rs256, "", rsa}, {WebTokenAlgorithm::es256, "", p256}};
        return check_web_token(keys, {"taken-back"}, text, {action, stream, audience}, Time(seconds(at)));
    }
    static Key rsa, p256;
};
Key WebTokenTest::rsa, WebTokenTest::p256;

TEST_F(WebTokenTest, LetsInWhomItNamesForWhatItNames) {
    for (const auto& text : {token(rsa, rs256, anna), token(p256, es256, anna)}) {
        EXPECT_EQ(check(text, "publish", "anna"), WebTokenCheck::good);
        EXPECT_EQ(check(text, "publish", "ben"), WebTokenCheck::not_for_this);
        EXPECT_EQ(check(text, "watch", "ben"), WebTokenCheck::good);
        EXPECT_EQ(check(text, "watch", "cara"), WebTokenCheck::not_for_this);
    }
    const auto all = token(p256, es256, R"({"exp":1000,"watch":"*"})");
    EXPECT_EQ(check(all, "watch", "cara"), WebTokenCheck::good);
    EXPECT_EQ(check(all, "publish", "cara"), WebTokenCheck::not_for_this);
}

TEST_F(WebTokenTest, HoldsFromItsBeginToItsEnd) {
    const auto text = token(p256, es256, R"({"exp":1000,"nbf":500,"watch":"anna"})");
    const auto at = [&](int second) { return check(text, "watch", "anna", "", second); };
    EXPECT_EQ(at(499), WebTokenCheck::too_early);
    EXPECT_EQ(at(500), WebTokenCheck::good);
    EXPECT_EQ(at(999), WebTokenCheck::good);
    EXPECT_EQ(at(1000), WebTokenCheck::expired);
    for (const char* claims :
         {R"({"watch":"anna"})", R"({"exp":"1000","watch":"anna"})", R"({"exp":null,"watch":"anna"})",
          R"({"exp":1000,"nbf":"1","watch":"anna"})", R"([1000])"})
        EXPECT_EQ(check(token(p256, es256, claims)), WebTokenCheck::malformed) << claims;
}

TEST_F(WebTokenTest, IsForItsAudienceAlone) {
    const auto none = token(p256, es256, anna), hub = token(p256, es256, R"({"exp":1000,"aud":"hub","watch":"anna"})"),
               two = token(p256, es256, R"({"exp":1000,"aud":["bank","hub"],"watch":"anna"})");
    EXPECT_EQ(check(none, "watch", "anna", "hub"), WebTokenCheck::not_for_this);
    EXPECT_EQ(check(hub, "watch", "anna", "hub"), WebTokenCheck::good);
    EXPECT_EQ(check(two, "watch", "anna", "hub"), WebTokenCheck::good);
    EXPECT_EQ(check(hub, "watch", "anna", "other"), WebTokenCheck::not_for_this);
    EXPECT_EQ(check(hub, "watch", "anna", ""), WebTokenCheck::not_for_this);
}

TEST_F(WebTokenTest, OneThatWasTakenBackIsOfNoUse) {
    EXPECT_EQ(check(token(p256, es256, R"({"exp":1000,"jti":"kept","watch":"anna"})")), WebTokenCheck::good);
    EXPECT_EQ(check(token(p256, es256, R"({"exp":1000,"jti":"taken-back","watch":"anna"})")), WebTokenCheck::revoked);
    EXPECT_EQ(check(token(p256, es256, R"({"exp":1000,"jti":7,"watch":"anna"})")), WebTokenCheck::malformed);
}

TEST_F(WebTokenTest, NobodyMakesOneWithoutTheKey) {
    const auto other = curve("P-256");
    EXPECT_EQ(check(token(other, es256, anna)), WebTokenCheck::forged);
    const auto good = token(p256, es256, anna);
    for (std::size_t i = 0; i < good.size(); ++i) {
        auto changed = good;
        changed[i] = changed[i] == 'A' ? 'B' : 'A';
        if (changed == good) continue;
        EXPECT_NE(check(changed), WebTokenCheck::good) << i;
    }
    for (std::size_t size = 0; size < good.size(); ++size)
        EXPECT_NE(check(good.substr(0, size)), WebTokenCheck::good) << size;
    EXPECT_NE(check(good + "="), WebTokenCheck::good);
    EXPECT_NE(check(good + ".A"), WebTokenCheck::good);
}

// What a token says of itself does not choose how it is checked.
TEST_F(WebTokenTest, NoOtherAlgorithmIsTaken) {
    for (const char* header :
         {R"({"alg":"none"})", R"({"alg":"None"})", R"({"alg":""})", R"({})", R"({"alg":["ES256"]})",
          R"({"alg":"ES384"})", R"({"alg":"PS256"})", R"({"alg":"HS256"})"}) {
        const auto text = base64(header) + '.' + base64(anna);
        EXPECT_EQ(check(text + '.'), WebTokenCheck::malformed) << header;
        EXPECT_EQ(check(text + '.' + base64(signature(p256, text))), WebTokenCheck::malformed) << header;
    }
    // By the public key as if it were a secret.
    const auto text = base64(R"({"alg":"HS256"})") + '.' + base64(anna), secret = pem_of(rsa);
    std::array<unsigned char, 32> by_secret{};
    unsigned size = 0;
    HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
         reinterpret_cast<const unsigned char*>(text.data()), text.size(), by_secret.data(), &size);
    EXPECT_EQ(check(text + '.' + base64({reinterpret_cast<const char*>(by_secret.data()), size})),
              WebTokenCheck::malformed);
    EXPECT_EQ(check(token(p256, rs256, anna)), WebTokenCheck::forged);
    EXPECT_EQ(check(token(rsa, es256, anna)), WebTokenCheck::forged);
    EXPECT_EQ(check(token(p256, R"({"alg":"ES256","crit":["x"],"x":1})", anna)), WebTokenCheck::malformed);
}

TEST_F(WebTokenTest, AKeyThatIsNamedIsTheOneThatCounts) {
    const WebTokenKeys keys = {{WebTokenAlgorithm::es256, "a", curve("P-256")}, {WebTokenAlgorithm::es256, "b", p256}};
    const auto by = [&](const std::string& header) {
        return check_web_token(keys, {}, token(p256, header, anna), {"watch", "anna", ""}, Time(seconds(1)));
    };
    EXPECT_EQ(by(R"({"alg":"ES256","kid":"b"})"), WebTokenCheck::good);
    EXPECT_EQ(by(R"({"alg":"ES256"})"), WebTokenCheck::good);
    EXPECT_EQ(by(R"({"alg":"ES256","kid":"a"})"), WebTokenCheck::forged);
}

class WebTokenKeysFile : public WebTokenTest {
protected:
    void SetUp() override {
        auto name = (fs::temp_directory_path() / "htvm-keys-XXXXXX").string();
        ASSERT_TRUE(mkdtemp(name.data()));
        folder = name;
    }
    void TearDown() override { fs::remove_all(folder); }
    Result<WebTokenKeys> read(const std::string& text) const {
        std::ofstream(folder / "keys") << text;
        return read_web_token_keys((folder / "keys").string());
    }
    static std::string entry(const Key& key, const std::string& more = "") {
        if (EVP_PKEY_is_a(key.get(), "RSA"))
            return R"({"kty":"RSA","n":")" + number_of(key, OSSL_PKEY_PARAM_RSA_N) + R"(","e":")" +
                   number_of(key, OSSL_PKEY_PARAM_RSA_E) + '"' + more + '}';
        return R"({"kty":"EC","crv":"P-256","x":")" + number_of(key, OSSL_PKEY_PARAM_EC_PUB_X) + R"(","y":")" +
               number_of(key, OSSL_PKEY_PARAM_EC_PUB_Y) + '"' + more + '}';
    }
    fs::path folder;
};

TEST_F(WebTokenKeysFile, HoldsKeysAsPemOrAsJson) {
    // A key whose numbers have all their bytes: JWKS has no fewer.
    auto full = curve("P-256");
    while (number_of(full, OSSL_PKEY_PARAM_EC_PUB_X).size() < 43 ||
           number_of(full, OSSL_PKEY_PARAM_EC_PUB_Y).size() < 43)
        full = curve("P-256");
    for (const auto& text :
         {pem_of(rsa) + pem_of(full), R"({"keys":[)" + entry(rsa, R"(,"kid":"r")") + ',' + entry(full) + "]}"}) {
        const auto keys = read(text);
        ASSERT_TRUE(keys) << keys.error().message;
        ASSERT_EQ(keys->size(), 2u);
        for (const auto& made : {token(rsa, rs256, anna), token(full, es256, anna)})
            EXPECT_EQ(check_web_token(*keys, {}, made, {"watch", "anna", ""}, Time(seconds(1))), WebTokenCheck::good);
    }
}

TEST_F(WebTokenKeysFile, KeysForSomethingElseArePassedOver) {
    const auto keys =
        read(R"({"keys":[{"kty":"oct","k":"AAAA"},{"kty":"EC","crv":"P-384","x":"","y":""},)" +
             entry(rsa, R"(,"use":"enc")") + ',' + entry(rsa, R"(,"alg":"RS512")") + ',' + entry(rsa) + "]}");
    ASSERT_TRUE(keys) << keys.error().message;
    EXPECT_EQ(keys->size(), 1u);
}

TEST_F(WebTokenKeysFile, WhatIsWeakBrokenOrNoneIsRefused) {
    EXPECT_FALSE(read_web_token_keys((folder / "none").string()));
    auto broken = pem_of(p256);
    broken[40] = broken[40] == 'A' ? 'B' : 'A';
    std::string many = R"({"keys":[)";
    for (std::size_t i = 0; i <= most_web_token_keys; ++i) many += (i ? "," : "") + entry(rsa);
    for (const auto& text :
         {std::string(), std::string("{}"), std::string(R"({"keys":[]})"), pem_of(rsa_of(1024)), pem_of(curve("P-384")),
          broken, pem_of(rsa) + broken, many + "]}", std::string(R"({"keys":[{"kty":"RSA","n":"!","e":"AQAB"}]})"),
          std::string(R"({"keys":[{"kty":"EC","crv":"P-256","x":"AA","y":"AA"}]})"),
          R"({"keys":[{"kty":"EC","crv":"P-256","x":")" + base64(std::string(32, 1)) + R"(","y":")" +
              base64(std::string(32, 1)) + "\"}]}"})
        EXPECT_FALSE(read(text)) << text;
}

TEST_F(WebTokenKeysFile, RevocationsAreALineEach) {
    std::ofstream(folder / "revoked") << "# those of May\n\nabc  # anna's\n  def\r\n";
    const auto revoked = read_revocations((folder / "revoked").string());
    ASSERT_TRUE(revoked);
    EXPECT_EQ(*revoked, (Revocations{"abc", "def"}));
    std::ofstream(folder / "revoked") << std::string(129, 'a');
    EXPECT_FALSE(read_revocations((folder / "revoked").string()));
    EXPECT_FALSE(read_revocations((folder / "none").string()));
}

}  // namespace
}  // namespace htvm::live
