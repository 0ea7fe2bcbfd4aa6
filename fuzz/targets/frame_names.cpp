// Names of files, a line each: every name has a place in the order of its kind, and numbers ascend.
#include <algorithm>
#include <set>

#include "fuzz_input.h"
#include "io/sequence_names.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using fuzz::require;
    constexpr std::size_t most = 200;
    std::vector<std::string> names = {""};
    for (const char c : std::string(data, data + size)) {
        if (c != '\n')
            names.back() += c;
        else if (names.size() < most)
            names.emplace_back();
    }
    std::size_t counted = 0;
    for (const auto& kind : kinds_of_names(names, ".ply")) {
        counted += kind.places.size();
        std::vector<std::string> of_kind;
        for (const auto place : kind.places) of_kind.push_back(names[place]);
        const auto order = order_of_frames(of_kind, ".ply");
        if (!order) continue;
        const std::set<std::size_t> places(order->places.begin(), order->places.end());
        require(order->places.size() == of_kind.size() && places.size() == of_kind.size(), "each name once");
        require(order->numbers.empty() || order->numbers.size() == of_kind.size(), "a number each, or none");
        for (std::size_t k = 1; k < order->numbers.size(); ++k)
            require(order->numbers[k] > order->numbers[k - 1], "numbers ascend");
        (void)frame_step(order->numbers);
    }
    require(counted == names.size(), "each name is of one kind");
    (void)order_by_first_number(names);
    (void)is_text_order(names);
    for (const auto& name : names) {
        const auto original = original_of_copy(name);
        require(!original || (!original->empty() && original->size() < name.size()), "a copy's name is longer");
        (void)is_unfinished_name(name);
    }
    return 0;
}
