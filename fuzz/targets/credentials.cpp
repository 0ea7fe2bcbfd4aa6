// What a client sends to be let in: no link but the hub's own is good, for the path and the time that it was made for;
// tokens and names are parts of what was sent.
#include "live/server/credentials.h"

#include "fuzz_input.h"
#include "live/files/http_request.h"
#include "live/hub/stream_name.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using Time = std::chrono::system_clock::time_point;
    fuzz::FuzzInput input(data, size);
    const Time expires{std::chrono::seconds(input.u32())}, now{std::chrono::seconds(input.u32())};
    const auto place = input.u16();
    const auto replacement = static_cast<char>(input.u8());
    const auto rest = input.rest();
    const std::string text(rest.begin(), rest.end());

    const live::LinkKeys keys = {{1, live::LinkKey{1}}, {7, live::LinkKey{2}}};
    const auto query = live::link_query(keys, "watch/anna", expires);
    const auto good = now < expires ? live::LinkCheck::good : live::LinkCheck::expired;
    fuzz::require(live::check_link(keys, "watch/anna", '?' + query, now) == good, "a link is good until it expires");
    auto changed = query;
    changed[place % changed.size()] = replacement;
    const auto check = live::check_link(keys, "watch/anna", '?' + changed, now);
    fuzz::require(changed == query || (check != live::LinkCheck::good && check != live::LinkCheck::expired),
                  "a link that was changed is not good");
    if (text.find(query.substr(query.size() - 64)) == std::string::npos) {
        const auto other = live::check_link(keys, "watch/anna", text, now);
        fuzz::require(other == live::LinkCheck::missing || other == live::LinkCheck::forged,
                      "nobody can make a link without the key");
    }
    if (text != "watch/anna")
        fuzz::require(live::check_link(keys, text, '?' + query, now) == live::LinkCheck::forged,
                      "a link is good for its path alone");

    const auto segment = live::link_segment(query);
    fuzz::require(live::check_link(keys, "watch/anna", live::link_target(segment), now) == good,
                  "a link in a path is the same link");
    if (text.find(query.substr(query.size() - 64)) == std::string::npos) {
        const auto other = live::check_link(keys, "watch/anna", live::link_target(text), now);
        fuzz::require(other == live::LinkCheck::missing || other == live::LinkCheck::forged,
                      "nobody can make one of a path without the key");
    }

    const auto token = live::bearer_token(text);
    fuzz::require(text.ends_with(token), "a token is the end of its header");
    const live::Publishers publishers = {{"anna", live::TokenHash{{1}, {2}}}};
    fuzz::require(!live::may_publish(publishers, "anna", token) && !live::may_publish(publishers, text, token),
                  "nobody publishes without the token");
    if (live::is_stream_name(text)) {
        const auto segments = live::path_segments('/' + text);
        fuzz::require(segments && *segments == std::vector{text},
                      "a stream's name is a segment of a path as it stands");
    }
    live::host_of_origin(text);
    live::whole_number(text);
    return 0;
}
