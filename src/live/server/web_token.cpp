#include "live/server/web_token.h"

#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/core_names.h>
#include <openssl/ec.h>
#include <openssl/ecdsa.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/param_build.h>
#include <openssl/pem.h>
#include <openssl/rsa.h>
#include <openssl/x509.h>

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "live/server/access_file.h"

namespace htvm::live {
namespace {

using Json = nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

template <auto destroy>
struct Destroy {
    template <class T>
    void operator()(T* object) const {
        destroy(object);
    }
};
template <class T, auto destroy>
using Owned = std::unique_ptr<T, Destroy<destroy>>;
using Number = Owned<BIGNUM, BN_free>;
using Parameters = Owned<OSSL_PARAM, OSSL_PARAM_free>;

constexpr std::size_t p256_bytes = 32;

// ---- Base64 as RFC 7515 has it: of the alphabet for addresses, without what fills up
// ---------------------------------

std::optional<std::uint32_t> value_of(char c) {
    constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    const auto at = alphabet.find(c);
    if (at == std::string_view::npos) return std::nullopt;
    return static_cast<std::uint32_t>(at);
}

// Bytes have one spelling: the bits that are left over are 0.
std::optional<Bytes> from_base64(std::string_view text) {
    if (text.size() % 4 == 1) return std::nullopt;
    Bytes out;
    out.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    unsigned count = 0;
    for (const char c : text) {
        const auto value = value_of(c);
        if (!value) return std::nullopt;
        bits = (bits << 6 | *value) & 0xffffu;
        count += 6;
        if (count < 8) continue;
        count -= 8;
        out.push_back(static_cast<std::uint8_t>(bits >> count));
    }
    if ((bits & ((1u << count) - 1)) != 0) return std::nullopt;
    return out;
}

std::optional<Json> object_in(std::string_view base64) {
    const auto bytes = from_base64(base64);
    if (!bytes) return std::nullopt;
    auto json = Json::parse(bytes->begin(), bytes->end(), nullptr, false);
    if (!json.is_object()) return std::nullopt;
    return json;
}

// "" of a member that is not there or no string.
std::string text_of(const Json& object, const char* name) {
    const auto found = object.find(name);
    const auto* text = found == object.end() ? nullptr : found->get_ptr<const std::string*>();
    return text ? *text : "";
}

// ---- Keys -----------------------------------------------------------------------------------------------------------

// Which algorithm it is for; nothing if it is for none that is taken here.
std::optional<WebTokenAlgorithm> algorithm_of(const EVP_PKEY* key) {
    constexpr int least_bits = 2048, most_bits = 8192;  // a larger one would take the hub's thread long
    if (EVP_PKEY_is_a(key, "RSA")) {
        const int bits = EVP_PKEY_get_bits(key);
        if (bits < least_bits || bits > most_bits) return std::nullopt;
        return WebTokenAlgorithm::rs256;
    }
    std::array<char, 64> group{};
    if (EVP_PKEY_is_a(key, "EC") && EVP_PKEY_get_group_name(key, group.data(), group.size(), nullptr) == 1 &&
        std::string_view(group.data()) == SN_X9_62_prime256v1)
        return WebTokenAlgorithm::es256;
    return std::nullopt;
}

std::shared_ptr<EVP_PKEY> key_of(const char* type, OSSL_PARAM* parameters) {
    const Owned<EVP_PKEY_CTX, EVP_PKEY_CTX_free> context(EVP_PKEY_CTX_new_from_name(nullptr, type, nullptr));
    EVP_PKEY* key = nullptr;
    if (!context || !parameters || EVP_PKEY_fromdata_init(context.get()) != 1 ||
        EVP_PKEY_fromdata(context.get(), &key, EVP_PKEY_PUBLIC_KEY, parameters) != 1)
        return nullptr;
    return {key, EVP_PKEY_free};
}

Number number_in(const Json& key, const char* name) {
    const auto bytes = from_base64(text_of(key, name));
    if (!bytes || bytes->empty()) return nullptr;
    return Number(BN_bin2bn(bytes->data(), static_cast<int>(bytes->size()), nullptr));
}

std::shared_ptr<EVP_PKEY> rsa_key(const Json& key) {
    const auto modulus = number_in(key, "n"), exponent = number_in(key, "e");
    const Owned<OSSL_PARAM_BLD, OSSL_PARAM_BLD_free> build(OSSL_PARAM_BLD_new());
    if (!modulus || !exponent || !build ||
        OSSL_PARAM_BLD_push_BN(build.get(), OSSL_PKEY_PARAM_RSA_N, modulus.get()) != 1 ||
        OSSL_PARAM_BLD_push_BN(build.get(), OSSL_PKEY_PARAM_RSA_E, exponent.get()) != 1)
        return nullptr;
    return key_of("RSA", Parameters(OSSL_PARAM_BLD_to_param(build.get())).get());
}

std::shared_ptr<EVP_PKEY> p256_key(const Json& key) {
    const auto x = from_base64(text_of(key, "x")), y = from_base64(text_of(key, "y"));
    if (text_of(key, "crv") != "P-256" || !x || !y || x->size() != p256_bytes || y->size() != p256_bytes)
        return nullptr;
    Bytes point{POINT_CONVERSION_UNCOMPRESSED};
    point.insert(point.end(), x->begin(), x->end());
    point.insert(point.end(), y->begin(), y->end());
    const Owned<OSSL_PARAM_BLD, OSSL_PARAM_BLD_free> build(OSSL_PARAM_BLD_new());
    if (!build ||
        OSSL_PARAM_BLD_push_utf8_string(build.get(), OSSL_PKEY_PARAM_GROUP_NAME, SN_X9_62_prime256v1, 0) != 1 ||
        OSSL_PARAM_BLD_push_octet_string(build.get(), OSSL_PKEY_PARAM_PUB_KEY, point.data(), point.size()) != 1)
        return nullptr;
    return key_of("EC", Parameters(OSSL_PARAM_BLD_to_param(build.get())).get());
}

// False if one cannot be read; those that are for something else are passed over.
bool read_key_set(const Json& json, WebTokenKeys& out) {
    const auto keys = json.find("keys");
    if (keys == json.end() || !keys->is_array()) return false;
    for (const auto& key : *keys) {
        if (!key.is_object()) return false;
        const auto type = text_of(key, "kty"), use = text_of(key, "use"), algorithm = text_of(key, "alg");
        const bool rsa = type == "RSA", elliptic = type == "EC" && text_of(key, "crv") == "P-256";
        if (!rsa && !elliptic) continue;
        if (!use.empty() && use != "sig") continue;
        if (!algorithm.empty() && algorithm != (rsa ? "RS256" : "ES256")) continue;
        auto made = rsa ? rsa_key(key) : p256_key(key);
        const auto fits = made ? algorithm_of(made.get()) : std::nullopt;
        if (!fits) return false;
        out.push_back({*fits, text_of(key, "kid"), std::move(made)});
    }
    return true;
}

// False if what is there is not public keys alone.
bool read_pem(const std::string& text, WebTokenKeys& out) {
    const Owned<BIO, BIO_free_all> bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
    char *name = nullptr, *header = nullptr;
    std::uint8_t* data = nullptr;
    long size = 0;
    bool good = bio != nullptr;
    while (good && PEM_read_bio(bio.get(), &name, &header, &data, &size) == 1) {
        const std::uint8_t* der = data;
        std::shared_ptr<EVP_PKEY> key(
            std::string_view(name) == PEM_STRING_PUBLIC ? d2i_PUBKEY(nullptr, &der, size) : nullptr, EVP_PKEY_free);
        const auto fits = key ? algorithm_of(key.get()) : std::nullopt;
        good = fits.has_value();
        if (good) out.push_back({*fits, "", std::move(key)});
        OPENSSL_free(name);
        OPENSSL_free(header);
        OPENSSL_free(data);
    }
    good = good && ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
    ERR_clear_error();
    return good;
}

// ---- Signatures -----------------------------------------------------------------------------------------------------

// A token has the two numbers of an ECDSA signature as they are, OpenSSL takes them as DER.
Bytes der_of(std::span<const std::uint8_t> signature) {
    const Owned<ECDSA_SIG, ECDSA_SIG_free> made(ECDSA_SIG_new());
    Number r(BN_bin2bn(signature.data(), p256_bytes, nullptr)),
        s(BN_bin2bn(signature.data() + p256_bytes, p256_bytes, nullptr));
    if (!made || !r || !s || ECDSA_SIG_set0(made.get(), r.get(), s.get()) != 1) return {};
    static_cast<void>(r.release());
    static_cast<void>(s.release());
    std::uint8_t* der = nullptr;
    const int size = i2d_ECDSA_SIG(made.get(), &der);
    if (size <= 0) return {};
    Bytes out(der, der + size);
    OPENSSL_free(der);
    return out;
}

bool signed_by(const WebTokenKey& key, std::string_view text, Bytes signature) {
    if (key.algorithm == WebTokenAlgorithm::es256) {
        if (signature.size() != 2 * p256_bytes) return false;
        signature = der_of(signature);
    }
    const Owned<EVP_MD_CTX, EVP_MD_CTX_free> context(EVP_MD_CTX_new());
    const bool good = context && !signature.empty() &&
                      EVP_DigestVerifyInit(context.get(), nullptr, EVP_sha256(), nullptr, key.key.get()) == 1 &&
                      EVP_DigestVerify(context.get(), signature.data(), signature.size(),
                                       reinterpret_cast<const std::uint8_t*>(text.data()), text.size()) == 1;
    ERR_clear_error();
    return good;
}

// ---- Claims ---------------------------------------------------------------------------------------------------------

// Whether a member is this text, or a list with it.
bool names(const Json& claims, const char* member, std::string_view wanted) {
    const auto found = claims.find(member);
    if (found == claims.end()) return false;
    const auto same = [wanted](const Json& value) {
        const auto* text = value.get_ptr<const std::string*>();
        return text && *text == wanted;
    };
    if (!found->is_array()) return same(*found);
    for (const auto& one : *found)
        if (same(one)) return true;
    return false;
}

// A time in seconds since 1970; nothing if the member is there and is none.
std::optional<double> time_of(const Json& claims, const char* member, double otherwise) {
    const auto found = claims.find(member);
    if (found == claims.end()) return otherwise;
    if (!found->is_number()) return std::nullopt;
    const auto seconds = found->get<double>();
    if (!std::isfinite(seconds)) return std::nullopt;
    return seconds;
}

WebTokenCheck check_claims(const Json& claims, const Revocations& revoked, const WebTokenUse& use,
                           std::chrono::system_clock::time_point now) {
    if (!claims.contains("exp")) return WebTokenCheck::malformed;
    const auto expires = time_of(claims, "exp", 0), begins = time_of(claims, "nbf", 0);
    if (!expires || !begins) return WebTokenCheck::malformed;
    const auto seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
    if (seconds >= *expires) return WebTokenCheck::expired;
    if (seconds < *begins) return WebTokenCheck::too_early;
    const auto id = text_of(claims, "jti");
    // One that has an id of another kind could not be taken back.
    if (claims.contains("jti") && id.empty()) return WebTokenCheck::malformed;
    if (!id.empty() && revoked.contains(id)) return WebTokenCheck::revoked;
    if (use.audience.empty() ? claims.contains("aud") : !names(claims, "aud", use.audience))
        return WebTokenCheck::not_for_this;
    const std::string action(use.action);
    return names(claims, action.c_str(), use.stream) || names(claims, action.c_str(), "*")
               ? WebTokenCheck::good
               : WebTokenCheck::not_for_this;
}

struct Parts {
    std::string_view header, claims, signature, what_is_signed;
};

std::optional<Parts> parts_of(std::string_view token) {
    const auto first = token.find('.');
    const auto second = first == std::string_view::npos ? first : token.find('.', first + 1);
    if (second == std::string_view::npos || token.find('.', second + 1) != std::string_view::npos) return std::nullopt;
    return Parts{token.substr(0, first), token.substr(first + 1, second - first - 1), token.substr(second + 1),
                 token.substr(0, second)};
}

}  // namespace

Result<WebTokenKeys> read_web_token_keys(const std::string& path) {
    const auto text = read_access_file(path);
    if (!text) return tl::unexpected(text.error());
    if (text->find("PRIVATE KEY-----") != std::string::npos)
        return fail(ErrorKind::bad_input, path +
                                              " holds a private key, which only who signs tokens may have; give its "
                                              "public key (openssl pkey -in KEY -pubout)");
    WebTokenKeys out;
    const auto json = Json::parse(*text, nullptr, false);
    const bool read = json.is_object() ? read_key_set(json, out) : read_pem(*text, out);
    if (!read || out.empty() || out.size() > most_web_token_keys)
        return fail(ErrorKind::bad_input, path + " must hold 1 to " + std::to_string(most_web_token_keys) +
                                              " public keys, PEM or JWKS: RSA of 2048 to 8192 bits, or P-256");
    return out;
}

bool looks_like_web_token(std::string_view token) { return parts_of(token).has_value(); }

WebTokenCheck check_web_token(const WebTokenKeys& keys, const Revocations& revoked, std::string_view token,
                              const WebTokenUse& use, std::chrono::system_clock::time_point now) {
    const auto parts = token.size() <= most_web_token_bytes ? parts_of(token) : std::nullopt;
    if (!parts) return WebTokenCheck::malformed;
    const auto header = object_in(parts->header);
    auto signature = from_base64(parts->signature);
    // What a header says is critical must be understood, and nothing of the kind is here.
    if (!header || !signature || header->contains("crit")) return WebTokenCheck::malformed;
    const auto algorithm = text_of(*header, "alg"), id = text_of(*header, "kid");
    if (algorithm != "RS256" && algorithm != "ES256") return WebTokenCheck::malformed;
    const auto wanted = algorithm == "RS256" ? WebTokenAlgorithm::rs256 : WebTokenAlgorithm::es256;
    bool good = false;
    for (const auto& key : keys) {
        if (key.algorithm != wanted || (!id.empty() && !key.id.empty() && key.id != id)) continue;
        good = good || signed_by(key, parts->what_is_signed, *signature);
    }
    if (!good) return WebTokenCheck::forged;
    const auto claims = object_in(parts->claims);
    return claims ? check_claims(*claims, revoked, use, now) : WebTokenCheck::malformed;
}

const char* web_token_sentence(WebTokenCheck check) {
    switch (check) {
        case WebTokenCheck::good:
            return "this token is good";
        case WebTokenCheck::malformed:
            return "this is no token that this hub reads: a JWT by RS256 or ES256 that says when it expires";
        case WebTokenCheck::forged:
            return "this token was not signed by a key that this hub knows";
        case WebTokenCheck::expired:
            return "this token has expired";
        case WebTokenCheck::too_early:
            return "this token is not good yet";
        case WebTokenCheck::not_for_this:
            return "this token is not for this";
        case WebTokenCheck::revoked:
            return "this token was taken back";
    }
    return "";
}

}  // namespace htvm::live
