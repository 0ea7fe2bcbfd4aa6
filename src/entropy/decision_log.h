// Decisions in the order of a stream and what they cost, to be written when it is known what comes before them. Encoder
// only.
#pragma once

#include <cstdint>
#include <vector>

#include "entropy/cost.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

class DecisionLog {
public:
    bool bit(BinaryModel& model, bool wanted) {
        bits_ += decision_cost(model, wanted);
        decisions_.push_back({wanted, model.one, 0});
        model.update(wanted);
        return wanted;
    }
    std::uint32_t raw(std::uint32_t wanted, int n) {
        bits_ += n;
        if (n > 0) decisions_.push_back({wanted, 0, static_cast<std::uint8_t>(n)});
        return wanted;
    }
    double bits() const { return bits_; }
    void clear() { decisions_.clear(), bits_ = 0; }
    void append(const DecisionLog& more) {
        decisions_.insert(decisions_.end(), more.decisions_.begin(), more.decisions_.end());
        bits_ += more.bits_;
    }
    void write(RangeEncoder& encoder) const {
        for (const auto& decision : decisions_) {
            BinaryModel model{decision.one, model_seen_limit};
            if (decision.width > 0)
                encoder.raw(decision.value, decision.width);
            else
                encoder.bit(model, decision.value != 0);
        }
    }
    // The decisions as a run of their own.
    std::vector<std::uint8_t> run() const {
        RangeEncoder encoder;
        write(encoder);
        return encoder.finish();
    }

private:
    struct Decision {
        std::uint32_t value;
        std::uint16_t one;   // of the model
        std::uint8_t width;  // 0: under a model
    };
    std::vector<Decision> decisions_;
    double bits_ = 0;
};

}  // namespace htvm::internal
