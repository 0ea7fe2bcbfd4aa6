#include "io/skeleton_azure_body.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace htvm {
namespace {

// The frames in which a body is, ascending, each with its place in the list.
using Sightings = std::map<std::size_t, std::size_t>;

bool overlap(const Sightings& a, const Sightings& b) {
    return std::any_of(a.begin(), a.end(), [&](const auto& seen) { return b.count(seen.first) > 0; });
}

// Whether a body is where the subject was, in the two frames of both that are nearest in time: of its first frame and
// the subject's last one before, or of its last one and the subject's first behind.
bool goes_on(const std::vector<AzureBodies>& frames, const Sightings& subject, const Sightings& body) {
    constexpr double farthest = 1000;  // mm
    const auto is_near = [&](const auto& a, const auto& b) {
        const auto &p = frames[a.first][a.second].place, &q = frames[b.first][b.second].place;
        return p && q && std::hypot((*p)[0] - (*q)[0], (*p)[1] - (*q)[1], (*p)[2] - (*q)[2]) <= farthest;
    };
    const auto behind = subject.upper_bound(body.begin()->first);
    if (behind != subject.begin() && is_near(*std::prev(behind), *body.begin())) return true;
    const auto after = subject.upper_bound(body.rbegin()->first);
    return after != subject.end() && is_near(*after, *body.rbegin());
}

}  // namespace

std::vector<std::optional<std::size_t>> choose_azure_body(const std::vector<AzureBodies>& frames,
                                                          std::vector<std::string>& notes) {
    struct Body {
        std::int64_t id = 0;
        Sightings seen;
    };
    std::vector<Body> bodies;
    std::map<std::int64_t, std::size_t> of_id;
    for (std::size_t t = 0; t < frames.size(); ++t)
        for (std::size_t i = 0; i < frames[t].size(); ++i) {
            const auto [entry, is_new] = of_id.try_emplace(frames[t][i].id, bodies.size());
            if (is_new) bodies.push_back({frames[t][i].id, {}});
            bodies[entry->second].seen.try_emplace(t, i);  // the first, if it is listed twice in one frame
        }
    std::vector<std::optional<std::size_t>> out(frames.size());
    if (bodies.empty()) return out;
    std::stable_sort(bodies.begin(), bodies.end(),
                     [](const Body& a, const Body& b) { return a.seen.size() > b.seen.size(); });
    constexpr std::size_t most_compared = 128;
    const std::size_t compared = std::min(bodies.size(), most_compared);
    Sightings subject = bodies[0].seen;
    std::vector<bool> is_joined(bodies.size());
    std::string joined;
    for (bool any = true; any;) {
        any = false;
        for (std::size_t b = 1; b < compared; ++b) {
            if (is_joined[b] || overlap(bodies[b].seen, subject) || !goes_on(frames, subject, bodies[b].seen)) continue;
            subject.insert(bodies[b].seen.begin(), bodies[b].seen.end());
            joined += (joined.empty() ? "" : ", ") + std::to_string(bodies[b].id);
            is_joined[b] = any = true;
        }
    }
    if (bodies.size() > 1)
        notes.push_back("The file tracks " + std::to_string(bodies.size()) + " bodies: body " +
                        std::to_string(bodies[0].id) + " is taken, seen in most frames (" +
                        std::to_string(bodies[0].seen.size()) + " of " + std::to_string(frames.size()) + ").");
    if (!joined.empty())
        notes.push_back(
            "Where it is not seen, others are that stand where it was, as of a tracker that lost it: " + joined + ".");
    for (const auto& [t, place] : subject) out[t] = place;
    return out;
}

}  // namespace htvm
