// Takes back what a library does to the priority of threads. SVT-AV1, where it runs as root, puts its own threads and
// the one that calls it before all else on the machine (SCHED_FIFO, 99): a coder of files would hold up whoever serves
// a live stream beside it.
#pragma once

#include <vector>

namespace htvm {

// The numbers of the process's threads that go before all else; none where the system does not tell.
std::vector<int> threads_before_all_else();

// Those that are not among these have their turn as others do again.
void take_back_precedence(const std::vector<int>& but_from);

}  // namespace htvm
