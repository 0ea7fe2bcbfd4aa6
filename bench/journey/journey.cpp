// Encodes three frames of the synthetic person on one thread, an I-frame and two T-frames. Prints every call that the
// last one makes within the codec, once each: the addresses of the caller and the called function, in the order of
// first occurrence.
#include <cstdio>
#include <cstdlib>
#include <set>
#include <utility>
#include <vector>

#include "htvm/encoder.hpp"
#include "synth/synth.h"

namespace {

using Call = std::pair<void*, void*>;

struct Journey {
    bool recorded = false;
    std::vector<void*> entered;  // functions entered, the innermost last
    std::set<Call> known;
    std::vector<Call> calls;
};

Journey journey;

// In trees from before profiles existed, `tracked` is a switch; in later ones it is the default profile.
template <class Options>
void choose_tracked(Options& options) {
    if constexpr (requires { options.tracked = true; }) options.tracked = true;
}

}  // namespace

extern "C" {

void __cyg_profile_func_enter(void* function, void*) {
    if (!journey.recorded) return;
    const Call call{journey.entered.empty() ? nullptr : journey.entered.back(), function};
    journey.entered.push_back(function);
    if (journey.known.insert(call).second) journey.calls.push_back(call);
}

void __cyg_profile_func_exit(void*, void*) {
    if (journey.recorded && !journey.entered.empty()) journey.entered.pop_back();
}

}  // extern "C"

int main() {
    htvm::SynthOptions person;
    person.vertices = 1500;
    htvm::EncoderOptions options;
    choose_tracked(options);
    options.threads = 1;
    options.skeleton = htvm::synth_skeleton();
    auto encoder = htvm::Encoder::create(options);
    if (!encoder) return EXIT_FAILURE;
    for (int frame = 0; frame < 3; ++frame) {
        const auto made = htvm::synth_frame(person, 40 + frame);
        journey.recorded = frame == 2;
        const auto pushed = encoder->push(made.mesh, &made.pose, frame);
        journey.recorded = false;
        if (!pushed || encoder->last_frame().type != (frame == 0 ? htvm::FrameType::intra : htvm::FrameType::tracked)) {
            std::fprintf(stderr, "frame %d did not become what it should\n", frame);
            return EXIT_FAILURE;
        }
    }
    for (const auto& [caller, callee] : journey.calls) std::printf("%p %p\n", caller, callee);
}
