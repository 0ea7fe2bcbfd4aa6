#include "htvm/dependency.hpp"

#include <algorithm>

#include "codec/bones/codebook.h"
#include "codec/format/frame_kinds.h"
#include "codec/format/sequence.h"
#include "codec/tracked/frame_group.h"
#include "core/crc32.h"
#include "htvm/texture.hpp"

namespace htvm {

using namespace internal;

PacketHeader header_with_flags(const Packet& packet) {
    PacketHeader out = packet;
    if (out.has(packet_flag::flags_valid)) return out;
    out.flags = packet_flag::flags_valid;
    if (packet.kind == PacketKind::sequence) out.reference = crc32(packet.payload);
    if (packet.kind == PacketKind::codebook && !packet.payload.empty() && packet.payload[0] == codebook_for_colour)
        out.flags |= packet_flag::colour;
    if (const auto type = frame_type(packet.kind)) {
        const auto& rules = rules_of(*type);
        out.flags |= rules.referred ? packet_flag::referred : packet_flag::droppable;
        // Whether decoding can start at a T-frame follows from the frames before it.
        if (rules.refers_to != RefersTo::reference_or_before) out.flags |= packet_flag::access;
    }
    return out;
}

std::uint64_t Dependencies::push(const PacketHeader& header) {
    const auto place = pushed_++;
    if (header.kind == PacketKind::sequence) push_header(header, place);
    if (header.kind == PacketKind::codebook) push_codebook(header, place);
    if (header.kind == PacketKind::texture) push_picture(header, place);
    if (frame_type(header.kind)) push_frame(header, place);
    return place;
}

void Dependencies::begin_sequence() {
    ++sequences_;
    highest_frame_.reset();
    forget_reference();
    newest_ = {};
    pictures_.clear();
    newest_picture_.reset();
}

void Dependencies::forget_reference() {
    references_.clear();
    chain_.clear();
    codebooks_ = {};
    unmarked_codebooks_.clear();
}

void Dependencies::push_header(const PacketHeader& header, std::uint64_t place) {
    HeaderInForce pushed{place, {}, header.has(packet_flag::flags_valid) && header.has(packet_flag::session)};
    if (header.has(packet_flag::flags_valid)) pushed.crc = header.reference;
    const bool same = header_ && header_->crc == pushed.crc;
    if (begins_sequence(same, pushed.session, header.frame, highest_frame_)) begin_sequence();
    header_ = pushed;
}

void Dependencies::push_codebook(const PacketHeader& header, std::uint64_t place) {
    if (references_.empty() || references_.back().number != header.reference) return;
    if (header.has(packet_flag::flags_valid)) {
        codebooks_.marked[header.has(packet_flag::colour)] = place;
        return;
    }
    unmarked_codebooks_.push_back(place);
    codebooks_.unmarked = unmarked_codebooks_.size();
    if (unmarked_codebooks_.size() <= most_) return;
    forget_reference();
    newest_ = {};
}

void Dependencies::push_frame(const PacketHeader& header, std::uint64_t place) {
    newest_ = {};
    if (!header_) return;
    highest_frame_ = std::max(highest_frame_.value_or(0), header.frame);
    const auto& rules = rules_of(*frame_type(header.kind));
    const bool referred = is_referred(header, rules);
    if (rules.refers_to == RefersTo::nothing) {
        newest_ = {.place = place, .known = true};
        if (!referred) return;
        forget_reference();
        references_.push_back({header.frame, place});
        return;
    }
    const auto chained = rules.refers_to == RefersTo::reference_or_before ? chained_up_to(header.reference) : 0;
    if (references_.empty() || (chained == 0 && references_.back().number != header.reference)) return;
    newest_ = {.place = place,
               .references = references_.size(),
               .codebooks = rules.codebooks ? codebooks_ : Codebooks{},
               .chained = chained,
               .known = true};
    if (!referred) return;
    // The newest frame itself becomes the last of the chain; what it needs is what comes before it there.
    chain_.resize(chained);
    (rules.renews ? references_ : chain_).push_back({header.frame, place});
    if (references_.size() + chain_.size() <= most_ + 1) return;
    forget_reference();
    newest_ = {};
}

void Dependencies::push_picture(const PacketHeader& header, std::uint64_t place) {
    newest_picture_.reset();
    if (!header_) return;
    const bool key = is_key_picture(header);
    const auto named = std::find_if(pictures_.begin(), pictures_.end(),
                                    [&](const Frame& picture) { return picture.number == header.reference; });
    if (!key && named == pictures_.end()) return;
    const auto before = key ? std::size_t{0} : static_cast<std::size_t>(named - pictures_.begin()) + 1;
    newest_picture_ = {place, before};
    if (header.has(packet_flag::flags_valid) && !header.has(packet_flag::referred)) return;
    pictures_.resize(before);
    pictures_.push_back({header.frame, place});
    if (pictures_.size() <= most_) return;
    pictures_.clear();
    newest_picture_.reset();
}

// How many frames of chain_ one needs that refers to this one; 0 if it is none of them. Only within a group of T-frames
// may it be another than the last.
std::size_t Dependencies::chained_up_to(std::uint32_t number) const {
    for (std::size_t i = chain_.size(); i > 0 && chain_.size() - i < most_in_group; --i)
        if (chain_[i - 1].number == number) return i;
    return 0;
}

std::vector<std::uint64_t> Dependencies::places(std::size_t references, const Codebooks& codebooks,
                                                std::size_t chained) const {
    std::vector<std::uint64_t> out;
    for (std::size_t i = 0; i < references; ++i) out.push_back(references_[i].place);
    for (const auto& place : codebooks.marked)
        if (place) out.push_back(*place);
    for (std::size_t i = 0; i < codebooks.unmarked; ++i) out.push_back(unmarked_codebooks_[i]);
    for (std::size_t i = 0; i < chained; ++i) out.push_back(chain_[i].place);
    std::sort(out.begin(), out.end());
    if (header_) out.insert(out.begin(), header_->place);
    return out;
}

std::vector<std::uint64_t> Dependencies::closure() const {
    if (!newest_.known) return {};
    auto out = places(newest_.references, newest_.codebooks, newest_.chained);
    out.push_back(newest_.place);
    return out;
}

std::vector<std::uint64_t> Dependencies::picture_closure() const {
    if (!newest_picture_ || !header_) return {};
    std::vector<std::uint64_t> out = {header_->place};
    for (std::size_t i = 0; i < newest_picture_->before; ++i) out.push_back(pictures_[i].place);
    out.push_back(newest_picture_->place);
    return out;
}

std::vector<std::uint64_t> Dependencies::kept() const {
    auto out = places(references_.size(), codebooks_, chain_.size());
    const auto frames = static_cast<std::ptrdiff_t>(out.size());
    for (const auto& picture : pictures_) out.push_back(picture.place);
    if (header_) std::inplace_merge(out.begin() + 1, out.begin() + frames, out.end());
    return out;
}

std::vector<std::size_t> closure(std::span<const PacketHeader> packets, std::size_t frame) {
    if (frame >= packets.size()) return {};
    const bool picture = packets[frame].kind == PacketKind::texture;
    if (!picture && !frame_type(packets[frame].kind)) return {};
    Dependencies dependencies;
    for (const auto& packet : packets.first(frame + 1)) dependencies.push(packet);
    const auto places = picture ? dependencies.picture_closure() : dependencies.closure();
    return {places.begin(), places.end()};
}

}  // namespace htvm
