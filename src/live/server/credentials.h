// What people show to be let in: publishers their tokens, viewers links that expire. The files by which they are
// checked are the operator's own; tokens and links come from anyone.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "htvm/result.hpp"
#include "live/server/revocations.h"

namespace htvm::live {

// What is kept of a publisher's token, which has 256 random bits: a salted SHA-256 is enough, since nobody can try them
// all, and it makes checking cheap for the hub.
struct TokenHash {
    std::array<std::uint8_t, 16> salt{};
    std::array<std::uint8_t, 32> hash{};
};

// By the name of the one stream that each may publish.
using Publishers = std::map<std::string, TokenHash, std::less<>>;

// A JSON object: {"NAME": {"salt": HEX, "hash": HEX}, ...}. bad_input if the file is not that.
Result<Publishers> read_publishers(const std::string& path);

// Makes a token for a publisher, which replaces the one it had, and returns it: 64 hexadecimal digits. The file is made
// if there is none; only its owner may read it.
Result<std::string> add_publisher(const std::string& path, const std::string& name);

// Takes as long for a wrong token as for a right one, and for names that are not known.
bool may_publish(const Publishers& publishers, std::string_view name, std::string_view token);

// The token of an Authorization header: "Bearer TOKEN"; "" if it is none.
std::string_view bearer_token(std::string_view authorization);

// The keys that links are signed by. Links name theirs by its number, so that a new key can be taken into use while
// links by the one before are still good.
using LinkKey = std::array<std::uint8_t, 32>;
using LinkKeys = std::map<std::uint32_t, LinkKey>;
inline constexpr std::size_t most_link_keys = 2;

// A JSON object: {"NUMBER": HEX, ...} of one or two keys. bad_input if the file is not that.
Result<LinkKeys> read_link_keys(const std::string& path);

// Adds a random key, with the next number, and forgets all but the newest two. Returns its number.
Result<std::uint32_t> add_link_key(const std::string& path);

// The query of a link to what the hub has at this path, such as "watch/anna" or "files/anna.htvm", by the newest key:
// expires=UNIX_SECONDS&key=NUMBER&id=ID&signature=HEX. id: by which the link can be taken back, of letters and digits;
// "": it has none and cannot be.
std::string link_query(const LinkKeys& keys, std::string_view path, std::chrono::system_clock::time_point expires,
                       const std::string& id = "");
// A random one.
std::string new_link_id();

// The same as a segment of a path, for what names others beside it: EXPIRES-KEY-ID-SIGNATURE, without ID where there is
// none; and back, as a target with a query. "" if it is none.
std::string link_segment(std::string_view query);
std::string link_target(std::string_view segment);

enum class LinkCheck { good, missing, forged, expired, revoked };

// target: the request's; only its query is read here.
LinkCheck check_link(const LinkKeys& keys, std::string_view path, std::string_view target,
                     std::chrono::system_clock::time_point now, const Revocations& revoked = {});

// What to tell the viewer.
const char* link_sentence(LinkCheck check);

}  // namespace htvm::live
