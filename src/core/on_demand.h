// A value that is found when it is first asked for, once, and is constant from then on.
#pragma once

#include <functional>
#include <optional>
#include <utility>

namespace htvm::internal {

// Only one thread at a time may ask, until the value is there.
template <class Value>
class OnDemand {
public:
    explicit OnDemand(std::function<Value()> find) : find_(std::move(find)) {}
    // One that is known already.
    explicit OnDemand(Value value) : value_(std::move(value)) {}

    const Value& operator*() const {
        if (!value_) value_.emplace(find_());
        return *value_;
    }
    const Value* operator->() const { return &**this; }

private:
    std::function<Value()> find_;
    mutable std::optional<Value> value_;
};

}  // namespace htvm::internal
