#include "live/client/control.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <nlohmann/json.hpp>

namespace htvm::live {
namespace {

using nlohmann::json;

constexpr std::int64_t most_number = std::int64_t{1} << 53;
constexpr std::size_t session_digits = 16;
constexpr std::size_t most_name_bytes = 1024;  // of a stream, as of a request's path

// ---- Writing --------------------------------------------------------------------------------------------------------

// Names may be any bytes; what is no UTF-8 is replaced.
std::string text_of(const json& message) { return message.dump(-1, ' ', false, json::error_handler_t::replace); }

std::int64_t within_range(std::int64_t number) { return std::clamp(number, -most_number, most_number); }

std::uint64_t within_range(std::uint64_t number) { return std::min(number, static_cast<std::uint64_t>(most_number)); }

// ---- Reading --------------------------------------------------------------------------------------------------------

// The members of a message. The first that is wrong makes the message wrong; what is asked for afterwards does not
// matter.
class Members {
public:
    explicit Members(std::string_view text) {
        if (text.size() > most_text_bytes)
            wrong("the text message is longer than " + std::to_string(most_text_bytes) + " bytes");
        else  // without exceptions; a number that no double can hold is refused as well
            message_ = json::parse(text.begin(), text.end(), nullptr, false);
        if (!message_.is_object()) wrong("the text message is not a JSON object");
        type_ = words("type").value_or("");
        if (type_.empty()) wrong("the text message has no \"type\"");
    }

    const std::string& type() const { return type_; }

    std::optional<std::int64_t> number(const char* name, std::int64_t least, std::int64_t most = most_number) {
        const auto* value = find(name);
        if (!value) return std::nullopt;
        // An unsigned number above the signed ones would become negative.
        const bool whole = value->is_number_unsigned()
                               ? value->get<std::uint64_t>() <= static_cast<std::uint64_t>(most_number)
                               : value->is_number_integer();
        if (whole) {
            const auto out = value->get<std::int64_t>();
            if (out >= least && out <= most) return out;
        }
        wrong_member(name, "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most));
        return std::nullopt;
    }
    std::optional<std::int64_t> time(const char* name) { return number(name, -most_number); }
    std::uint64_t count(const char* name) { return static_cast<std::uint64_t>(needed(name, number(name, 0))); }

    std::optional<std::string> words(const char* name) {
        const auto* value = find(name);
        if (!value) return std::nullopt;
        if (value->is_string()) return value->get<std::string>();
        wrong_member(name, "must be a text");
        return std::nullopt;
    }

    std::optional<bool> truth(const char* name) {
        const auto* value = find(name);
        if (!value) return std::nullopt;
        if (value->is_boolean()) return value->get<bool>();
        wrong_member(name, "must be true or false");
        return std::nullopt;
    }

    std::optional<std::uint64_t> session() {
        const auto text = words("session");
        if (!text) return std::nullopt;
        std::uint64_t out = 0;
        const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), out, 16);
        if (text->size() == session_digits && error == std::errc{} && end == text->data() + text->size()) return out;
        wrong_member("session", "must be 16 hexadecimal digits");
        return std::nullopt;
    }

    std::vector<std::string> list(const char* name) {
        const auto* value = find(name);
        std::vector<std::string> out;
        if (!value) return out;
        bool texts = value->is_array();
        if (texts)
            for (const auto& item : *value) {
                texts = texts && item.is_string();
                if (texts) out.push_back(item.get<std::string>());
            }
        if (!texts) wrong_member(name, "must be a list of texts");
        return out;
    }

    // A member that its message must have.
    template <class Value>
    Value needed(const char* name, std::optional<Value> value) {
        if (!value) wrong_member(name, "is missing");
        return value.value_or(Value{});
    }

    void wrong_member(const char* name, const std::string& what) {
        wrong("\"" + std::string(name) + "\" of the text message " + (type_.empty() ? "" : "\"" + type_ + "\" ") +
              what);
    }

    template <class Message>
    Result<Message> result(Message message) const {
        if (error_) return tl::unexpected(*error_);
        return message;
    }

private:
    // Null: absent.
    const json* find(const char* name) const {
        if (error_) return nullptr;
        const auto found = message_.find(name);
        return found == message_.end() || found->is_null() ? nullptr : &*found;
    }
    void wrong(const std::string& what) {
        if (!error_) error_ = Error{ErrorKind::bad_input, what};
    }

    json message_;
    std::string type_;
    std::optional<Error> error_;
};

Hello read_hello(Members& members) {
    Hello out;
    out.version = static_cast<std::uint32_t>(members.needed("version", members.number("version", 1, UINT32_MAX)));
    out.stream = members.needed("stream", members.words("stream"));
    if (out.stream.size() > most_name_bytes) members.wrong_member("stream", "must be at most 1024 bytes long");
    out.session = members.session();
    out.hubs = members.list("hubs");
    return out;
}

Stamp read_stamp(Members& members) {
    Stamp out;
    out.frame = static_cast<std::uint32_t>(members.needed("frame", members.number("frame", 0, UINT32_MAX)));
    out.sent = members.needed("sent", members.time("sent"));
    out.hub = members.time("hub");
    return out;
}

}  // namespace

std::string session_text(std::uint64_t session) {
    std::array<char, session_digits> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), session, 16).ptr;
    const auto count = static_cast<std::size_t>(end - digits.data());
    return std::string(session_digits - count, '0') + std::string(digits.data(), count);
}

std::string write_text(const Hello& message) {
    json out = {{"type", "hello"}, {"version", message.version}, {"stream", message.stream}, {"hubs", json::array()}};
    if (message.session) out["session"] = session_text(*message.session);
    for (const auto& hub : message.hubs) {
        out["hubs"].push_back(hub);
        if (text_of(out).size() <= most_text_bytes) continue;
        out["hubs"].erase(out["hubs"].size() - 1);
    }
    return text_of(out);
}

std::string write_text(const HeartbeatFromPublisher& message) {
    json out = {{"type", "heartbeat"}};
    if (message.clock) out["clock"] = within_range(*message.clock);
    return text_of(out);
}

std::string write_text(const EndOfStream&) { return text_of({{"type", "end"}}); }

std::string write_text(const HeartbeatToPublisher& message) {
    return text_of({{"type", "heartbeat"},
                    {"viewers", within_range(message.viewers)},
                    {"packets", within_range(message.packets)},
                    {"bytes", within_range(message.bytes)},
                    {"damaged", within_range(message.damaged)}});
}

std::string write_text(const HeartbeatToViewer& message) {
    json out = {{"type", "heartbeat"},
                {"published", message.published},
                {"viewers", within_range(message.viewers)},
                {"dropped", within_range(message.dropped)}};
    if (message.clock) out["clock"] = within_range(*message.clock);
    if (message.session) out["session"] = session_text(*message.session);
    return text_of(out);
}

std::string write_text(const KeyFrameRequest&) { return text_of({{"type", "key_frame"}}); }

std::string write_text(const Gone& message) {
    // There is room for bytes that take six each in JSON; characters of several bytes are not cut apart.
    auto length = std::min<std::size_t>(message.reason.size(), 512);
    while (length < message.reason.size() && length > 0 && (message.reason[length] & 0xc0) == 0x80) --length;
    return text_of({{"type", "gone"}, {"reason", message.reason.substr(0, length)}});
}

std::string write_text(const Stamp& message) {
    json out = {{"type", "stamp"}, {"frame", message.frame}, {"sent", within_range(message.sent)}};
    if (message.hub) out["hub"] = within_range(*message.hub);
    return text_of(out);
}

Result<FromPublisher> read_from_publisher(std::string_view text) {
    Members members(text);
    FromPublisher out;
    if (members.type() == "heartbeat") out = HeartbeatFromPublisher{members.time("clock")};
    if (members.type() == "stamp") out = read_stamp(members);
    if (members.type() == "end") out = EndOfStream{};
    return members.result(std::move(out));
}

Result<FromViewer> read_from_viewer(std::string_view text) {
    Members members(text);
    FromViewer out;
    if (members.type() == "key_frame") out = KeyFrameRequest{};
    return members.result(out);
}

Result<ToPublisher> read_to_publisher(std::string_view text) {
    Members members(text);
    ToPublisher out;
    if (members.type() == "hello") out = read_hello(members);
    if (members.type() == "heartbeat")
        out = HeartbeatToPublisher{members.count("viewers"), members.count("packets"), members.count("bytes"),
                                   members.count("damaged")};
    if (members.type() == "key_frame") out = KeyFrameRequest{};
    return members.result(std::move(out));
}

Result<ToViewer> read_to_viewer(std::string_view text) {
    Members members(text);
    ToViewer out;
    if (members.type() == "hello") out = read_hello(members);
    if (members.type() == "heartbeat") {
        HeartbeatToViewer heartbeat;
        heartbeat.published = members.needed("published", members.truth("published"));
        heartbeat.clock = members.time("clock");
        heartbeat.session = members.session();
        heartbeat.viewers = members.count("viewers");
        heartbeat.dropped = members.count("dropped");
        out = heartbeat;
    }
    if (members.type() == "gone") out = Gone{members.words("reason").value_or("")};
    if (members.type() == "stamp") out = read_stamp(members);
    return members.result(std::move(out));
}

std::int64_t system_microseconds() {
    return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
        .count();
}

}  // namespace htvm::live
