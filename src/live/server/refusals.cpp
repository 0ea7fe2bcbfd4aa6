#include "live/server/refusals.h"

#include "live/hub/stream_name.h"

namespace htvm::live {

constexpr std::uint64_t most_logged = 10;  // a second

Response refusing_response(const Refusal& refusal, ResponseHeader header) {
    return sentence_response(refusal.status, refusal.why, std::move(header));
}

void Refusals::tell(const Refusal& refusal, const std::string& stream, const boost::asio::ip::address& address) {
    count(refusal.cause);
    if (++in_second_ > most_logged || !log_) return;
    log_({.name = "refused",
          .text = "refused: " + refusal.why,
          .stream = is_stream_name(stream) ? stream : "",
          .address = address.to_string()});
}

void Refusals::end_second() {
    if (in_second_ > most_logged && log_)
        log_({.name = "refused",
              .text = std::to_string(in_second_ - most_logged) + " more were refused in this second"});
    in_second_ = 0;
}

}  // namespace htvm::live
