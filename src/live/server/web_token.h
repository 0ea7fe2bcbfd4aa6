// Tokens that somebody else signs (JWT, RFC 7519): who may publish or watch which streams, until when. They are signed
// by RS256 or ES256, by keys whose public halves the operator gives; no other algorithm is taken, whatever a token says
// of itself, and a key is used for its own alone.
//
// The claims that count: exp, which every token needs; nbf; aud, which must name the hub's audience, and must not be
// there where it has none; jti, by which a token can be taken back; and publish and watch: a stream's name, a list of
// names, or "*" for all.
#pragma once

#include <openssl/types.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"
#include "live/server/revocations.h"

namespace htvm::live {

enum class WebTokenAlgorithm : std::uint8_t { rs256, es256 };

// A public key: RSA of 2,048 to 8,192 bits, or ECDSA on P-256.
struct WebTokenKey {
    WebTokenAlgorithm algorithm{};
    std::string id{};  // "kid": tokens that name one are checked by keys of this name alone; "": by any
    std::shared_ptr<EVP_PKEY> key{};
};
using WebTokenKeys = std::vector<WebTokenKey>;
inline constexpr std::size_t most_web_token_keys = 16, most_web_token_bytes = 4096;

// A file of one or more public keys: PEM ("-----BEGIN PUBLIC KEY-----"), or JSON, {"keys": [...]} (JWKS, RFC 7517), of
// which keys for other uses are passed over. bad_input if there is none, one cannot be read, or there are too many.
Result<WebTokenKeys> read_web_token_keys(const std::string& path);

// What somebody wants by it.
struct WebTokenUse {
    std::string_view action;  // "publish" or "watch",
    std::string_view stream;  // this one
    std::string_view audience{};
};

enum class WebTokenCheck { good, malformed, forged, expired, too_early, not_for_this, revoked };

// Whether it has the form of one: three parts with dots between. Such are no tokens of credentials.h.
bool looks_like_web_token(std::string_view token);

// Nothing of the token is looked at before its signature is good, but its header.
WebTokenCheck check_web_token(const WebTokenKeys& keys, const Revocations& revoked, std::string_view token,
                              const WebTokenUse& use, std::chrono::system_clock::time_point now);

// What to tell whoever sent it.
const char* web_token_sentence(WebTokenCheck check);

}  // namespace htvm::live
