#include "live/server/credentials.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "live/files/http_request.h"
#include "live/hub/stream_name.h"
#include "live/server/access_file.h"

namespace htvm::live {
namespace {

using Json = nlohmann::json;

std::string hex_of(std::span<const std::uint8_t> bytes) {
    constexpr const char* digits = "0123456789abcdef";
    std::string out;
    for (const auto byte : bytes) {
        out += digits[byte >> 4];
        out += digits[byte & 15];
    }
    return out;
}

std::optional<std::uint8_t> digit_of(char c) {
    if (c >= '0' && c <= '9') return static_cast<std::uint8_t>(c - '0');
    if (c >= 'a' && c <= 'f') return static_cast<std::uint8_t>(c - 'a' + 10);
    return std::nullopt;
}

// Exactly as many bytes as there is room for.
bool from_hex(std::string_view text, std::span<std::uint8_t> out) {
    if (text.size() != 2 * out.size()) return false;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const auto high = digit_of(text[2 * i]), low = digit_of(text[2 * i + 1]);
        if (!high || !low) return false;
        out[i] = static_cast<std::uint8_t>(*high << 4 | *low);
    }
    return true;
}

bool from_hex_string(const Json& text, std::span<std::uint8_t> out) {
    const auto* string = text.get_ptr<const std::string*>();
    return string && from_hex(*string, out);
}

template <std::size_t N>
std::array<std::uint8_t, N> random_bytes() {
    std::array<std::uint8_t, N> out{};
    // It fails only where the system has no source of randomness at all.
    if (RAND_bytes(out.data(), static_cast<int>(N)) != 1) std::abort();
    return out;
}

std::array<std::uint8_t, 32> hash_of(std::span<const std::uint8_t> salt, std::string_view token) {
    std::string salted(salt.begin(), salt.end());
    salted += token;
    std::array<std::uint8_t, 32> out{};
    if (EVP_Digest(salted.data(), salted.size(), out.data(), nullptr, EVP_sha256(), nullptr) != 1) std::abort();
    return out;
}

std::array<std::uint8_t, 32> signature_of(const LinkKey& key, std::uint32_t number, std::string_view path,
                                          std::uint64_t expires, const std::optional<std::string>& id) {
    // A path holds no line's end, nor does an id, so no two links are signed as the same text.
    const auto text = "htvm link\n" + std::string(path) + '\n' + std::to_string(expires) + '\n' +
                      std::to_string(number) + (id ? '\n' + *id : "");
    std::array<std::uint8_t, 32> out{};
    unsigned length = 0;
    // It fails only for want of memory; a signature that anyone could guess must not come of that.
    if (!HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
              reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), out.data(), &length))
        std::abort();
    return out;
}

Result<Json> read_json(const std::string& path) {
    const auto text = read_access_file(path);
    if (!text) return tl::unexpected(text.error());
    auto json = Json::parse(*text, nullptr, false);
    if (!json.is_object()) return fail(ErrorKind::bad_input, path + " is not a JSON object");
    return json;
}

// There in whole or not at all, and for its owner alone from its first byte on.
Result<void> write_secret(const std::string& path, const Json& json) {
    const auto text = json.dump(2) + '\n';
    auto partial = path + ".XXXXXX";
    const int file = mkstemp(partial.data());
    const auto failed = [&] {
        const int reason = errno;
        if (file >= 0) {
            close(file);
            unlink(partial.c_str());
        }
        return fail(reason == ENOSPC ? ErrorKind::disk_full : ErrorKind::bad_input,
                    path + " cannot be written: " + std::strerror(reason));
    };
    if (file < 0 || write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size()) || fsync(file) != 0 ||
        rename(partial.c_str(), path.c_str()) != 0)
        return failed();
    close(file);
    return {};
}

bool exists(const std::string& path) { return access(path.c_str(), F_OK) == 0; }

}  // namespace

Result<Publishers> read_publishers(const std::string& path) {
    const auto json = read_json(path);
    if (!json) return tl::unexpected(json.error());
    Publishers out;
    for (const auto& [name, entry] : json->items()) {
        auto& hash = out[name];
        if (!is_stream_name(name) || !entry.is_object() || !from_hex_string(entry.value("salt", Json()), hash.salt) ||
            !from_hex_string(entry.value("hash", Json()), hash.hash))
            return fail(ErrorKind::bad_input,
                        path + ": '" + name + "' is not a publisher as --add-publisher writes it");
    }
    return out;
}

Result<std::string> add_publisher(const std::string& path, const std::string& name) {
    if (!is_stream_name(name)) return fail(ErrorKind::bad_input, stream_name_rule);
    if (const std::string ladder(ladder_of(name)); ladder != name)
        return fail(ErrorKind::bad_input, name + " is a rung of " + ladder + ", whose token is for all rungs");
    Publishers publishers;
    if (exists(path)) {
        auto known = read_publishers(path);
        if (!known) return tl::unexpected(known.error());
        publishers = std::move(*known);
    }
    const auto token = hex_of(random_bytes<32>());
    auto& added = publishers[name];
    added.salt = random_bytes<16>();
    added.hash = hash_of(added.salt, token);
    Json json = Json::object();
    for (const auto& [known, hash] : publishers)
        json[known] = {{"salt", hex_of(hash.salt)}, {"hash", hex_of(hash.hash)}};
    if (auto ok = write_secret(path, json); !ok) return tl::unexpected(ok.error());
    return token;
}

bool may_publish(const Publishers& publishers, std::string_view name, std::string_view token) {
    const auto found = publishers.find(name);
    const bool known = found != publishers.end();
    const auto expected = known ? found->second : TokenHash{};
    const auto hash = hash_of(expected.salt, token);
    const bool same = CRYPTO_memcmp(hash.data(), expected.hash.data(), hash.size()) == 0;
    return known && same;
}

std::string_view bearer_token(std::string_view authorization) {
    constexpr std::string_view scheme = "bearer ";
    if (authorization.size() < scheme.size()) return "";
    for (std::size_t i = 0; i < scheme.size(); ++i) {
        const char c = authorization[i];
        if ((c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) != scheme[i]) return "";
    }
    return authorization.substr(std::min(authorization.find_first_not_of(' ', scheme.size()), authorization.size()));
}

Result<LinkKeys> read_link_keys(const std::string& path) {
    const auto json = read_json(path);
    if (!json) return tl::unexpected(json.error());
    LinkKeys out;
    for (const auto& [name, entry] : json->items()) {
        const auto number = whole_number(name);
        LinkKey key{};
        if (!number || *number > UINT32_MAX || !from_hex_string(entry, key))
            return fail(ErrorKind::bad_input, path + ": '" + name + "' is not a key as --add-link-key writes it");
        out[static_cast<std::uint32_t>(*number)] = key;
    }
    if (out.empty() || out.size() > most_link_keys)
        return fail(ErrorKind::bad_input, path + " must hold one key or two");
    return out;
}

Result<std::uint32_t> add_link_key(const std::string& path) {
    LinkKeys keys;
    if (exists(path)) {
        auto known = read_link_keys(path);
        if (!known) return tl::unexpected(known.error());
        keys = std::move(*known);
    }
    const std::uint32_t number = keys.empty() ? 1 : keys.rbegin()->first + 1;
    if (number == 0) return fail(ErrorKind::limit, path + ": there is no number above that of its newest key");
    keys[number] = random_bytes<32>();
    while (keys.size() > most_link_keys) keys.erase(keys.begin());
    Json json = Json::object();
    for (const auto& [known, key] : keys) json[std::to_string(known)] = hex_of(key);
    if (auto ok = write_secret(path, json); !ok) return tl::unexpected(ok.error());
    return number;
}

std::string new_link_id() { return hex_of(random_bytes<8>()); }

std::string link_query(const LinkKeys& keys, std::string_view path, std::chrono::system_clock::time_point expires,
                       const std::string& id) {
    const auto& [number, key] = *keys.rbegin();
    const auto seconds = static_cast<std::uint64_t>(
        std::max<std::int64_t>(0, std::chrono::floor<std::chrono::seconds>(expires).time_since_epoch().count()));
    const auto signed_id = id.empty() ? std::nullopt : std::optional(id);
    return "expires=" + std::to_string(seconds) + "&key=" + std::to_string(number) + (id.empty() ? "" : "&id=" + id) +
           "&signature=" + hex_of(signature_of(key, number, path, seconds, signed_id));
}

std::string link_segment(std::string_view query) {
    const auto target = '?' + std::string(query);
    const auto value = [&](const char* name) { return query_value(target, name).value_or(""); };
    const auto id = value("id");
    return value("expires") + '-' + value("key") + '-' + (id.empty() ? "" : id + '-') + value("signature");
}

std::string link_target(std::string_view segment) {
    std::vector<std::string> members(1);
    for (const char c : segment) {
        const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        if (c == '-' && members.size() < 4)
            members.emplace_back();
        else if (plain)
            members.back() += c;
        else
            return "";
    }
    if (members.size() < 3) return "";
    const auto id = members.size() == 4 ? "&id=" + members[2] : "";
    return "?expires=" + members[0] + "&key=" + members[1] + id + "&signature=" + members.back();
}

LinkCheck check_link(const LinkKeys& keys, std::string_view path, std::string_view target,
                     std::chrono::system_clock::time_point now, const Revocations& revoked) {
    const auto expires = query_value(target, "expires"), key = query_value(target, "key"),
               id = query_value(target, "id"), signature = query_value(target, "signature");
    if (!expires && !key && !signature) return LinkCheck::missing;
    if (!expires || !key || !signature) return LinkCheck::forged;
    const auto seconds = whole_number(*expires), number = whole_number(*key);
    std::array<std::uint8_t, 32> given{};
    if (!seconds || !number || *number > UINT32_MAX || !from_hex(*signature, given)) return LinkCheck::forged;
    const auto found = keys.find(static_cast<std::uint32_t>(*number));
    if (found == keys.end()) return LinkCheck::forged;
    const auto right = signature_of(found->second, found->first, path, *seconds, id);
    if (CRYPTO_memcmp(given.data(), right.data(), right.size()) != 0) return LinkCheck::forged;
    if (id && revoked.contains(*id)) return LinkCheck::revoked;
    const auto today = std::chrono::floor<std::chrono::seconds>(now).time_since_epoch().count();
    return today >= 0 && static_cast<std::uint64_t>(today) >= *seconds ? LinkCheck::expired : LinkCheck::good;
}

const char* link_sentence(LinkCheck check) {
    switch (check) {
        case LinkCheck::good:
            return "this link is good";
        case LinkCheck::missing:
            return "this needs a link: ask whoever runs this hub (htvm link writes one)";
        case LinkCheck::forged:
            return "this link is not one that this hub knows: it is incomplete, changed, or by a key no longer in use";
        case LinkCheck::expired:
            return "this link has expired: ask for a new one";
        case LinkCheck::revoked:
            return "this link was taken back: ask for a new one";
    }
    return "";
}

}  // namespace htvm::live
