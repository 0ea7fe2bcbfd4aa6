#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <latch>
#include <mutex>
#include <new>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "core/progress.h"

#ifdef _WIN32
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
// Needs the names of the former.
#include <tlhelp32.h>
#endif

namespace htvm::internal {
namespace {

using Pieces = std::vector<std::pair<std::size_t, std::size_t>>;

Pieces pieces_of(std::size_t count, Threads threads, std::size_t grain) {
    std::mutex mutex;
    Pieces out;
    parallel_for(count, threads, grain, [&](std::size_t begin, std::size_t end) {
        const std::scoped_lock lock(mutex);
        out.emplace_back(begin, end);
    });
    std::sort(out.begin(), out.end());
    return out;
}

#ifdef _WIN32
std::size_t threads_of_this_process() {
    const HANDLE threads = CreateToolhelp32Snapshot(TH32CS_SNAPTHREAD, 0);  // of all processes
    std::size_t count = 0;
    THREADENTRY32 thread = {};
    thread.dwSize = sizeof thread;
    for (BOOL more = Thread32First(threads, &thread); more; more = Thread32Next(threads, &thread))
        count += thread.th32OwnerProcessID == GetCurrentProcessId();
    CloseHandle(threads);
    return count;
}

// Windows' std::clock() counts the time that has passed.
double processor_seconds() {
    FILETIME begun, ended, kernel, user;
    GetProcessTimes(GetCurrentProcess(), &begun, &ended, &kernel, &user);
    auto seconds = [](const FILETIME& t) { return (t.dwHighDateTime * 4294967296.0 + t.dwLowDateTime) * 1e-7; };
    return seconds(kernel) + seconds(user);
}
#else
std::size_t threads_of_this_process() {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator("/proc/self/task"), std::filesystem::directory_iterator()));
}

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
#endif

// Whether this process comes to `expected` threads within ten seconds: the kernel lists a thread for a moment after it
// was joined.
bool comes_to_threads(std::size_t expected) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (threads_of_this_process() != expected) {
        if (std::chrono::steady_clock::now() > end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
}

// Runners supplied by a caller.
void in_order(std::size_t tasks, const std::function<void(std::size_t)>& task) {
    for (std::size_t t = 0; t < tasks; ++t) task(t);
}
void in_reverse(std::size_t tasks, const std::function<void(std::size_t)>& task) {
    for (std::size_t t = tasks; t-- > 0;) task(t);
}
void on_threads_of_their_own(std::size_t tasks, const std::function<void(std::size_t)>& task) {
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < tasks; ++t) threads.emplace_back([&task, t] { task(t); });
    for (auto& thread : threads) thread.join();
}

TEST(ParallelFor, CoversTheRangeOnceInPiecesOfAtLeastHalfTheGrain) {
    for (const unsigned threads : {1u, 2u, 3u, 7u}) {
        const ThreadPool pool(threads);
        for (const std::size_t count : {0u, 1u, 2u, 3u, 7u, 8u, 9u, 64u, 65u, 1000u})
            for (const std::size_t grain : {0u, 1u, 2u, 8u, 64u, 5000u}) {
                const auto pieces = pieces_of(count, pool, grain);
                std::size_t next = 0;
                for (const auto& [begin, end] : pieces) {
                    EXPECT_EQ(begin, next);
                    EXPECT_GT(end, begin) << "no empty piece";
                    EXPECT_TRUE(pieces.size() == 1 || 2 * (end - begin) >= grain) << count << " " << grain;
                    next = end;
                }
                EXPECT_EQ(next, count);
            }
    }
}

TEST(ParallelFor, IsOnePieceForTheCallersThreadAlone) { EXPECT_EQ(pieces_of(1000, {}, 1).size(), 1u); }

TEST(ParallelFor, UsesAllThreads) {
    const ThreadPool pool(4);
    std::latch all_here(4);
    std::atomic<int> waiting = 4;
    parallel_for(1000, pool, 1, [&](std::size_t, std::size_t) {
        if (waiting-- > 0) all_here.arrive_and_wait();  // returns once four threads have arrived
    });
}

TEST(ParallelFor, UsesNoMoreThreadsThanItIsTold) {
    const ThreadPool pool(8);
    std::atomic<int> inside = 0, most = 0;
    parallel_for(200, pool.threads().at_most(2), 1, [&](std::size_t, std::size_t) {
        const int now = ++inside;
        for (int before = most; now > before && !most.compare_exchange_weak(before, now);) continue;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        --inside;
    });
    EXPECT_LE(most, 2);
}

TEST(ParallelInvoke, RunsBothOnce) {
    for (const unsigned threads : {1u, 2u, 8u}) {
        std::atomic<int> first = 0, second = 0;
        parallel_invoke(
            ThreadPool(threads), [&] { ++first; }, [&] { ++second; });
        EXPECT_EQ(first, 1);
        EXPECT_EQ(second, 1);
    }
}

TEST(ParallelInvoke, TheSecondMayWaitForTheFirst) {
    for (const auto& runner : {TaskRunner(in_order), TaskRunner(in_reverse), TaskRunner(on_threads_of_their_own),
                               thread_pool(2), thread_pool(1)})
        for (int i = 0; i < 100; ++i) {
            std::atomic<bool> done = false;
            parallel_invoke(
                ThreadPool(2, runner),
                [&] {
                    done = true;
                    done.notify_all();
                },
                [&] { done.wait(false); });
            EXPECT_TRUE(done);
        }
}

TEST(ParallelInvoke, OfThreeTheLastMayWaitForTheFirstWhileTheSecondFollowsIt) {
    constexpr std::size_t steps = 1000;
    for (const auto& runner : {TaskRunner(in_order), TaskRunner(in_reverse), TaskRunner(on_threads_of_their_own),
                               thread_pool(3), thread_pool(1)}) {
        Progress first, second;
        std::vector<std::size_t> made(steps), doubled(steps), last(steps);
        parallel_invoke(
            ThreadPool(3, runner),
            [&] {
                const EndOfProgress end{first};
                for (std::size_t i = 0; i < steps; ++i) made[i] = i + 1, first.reach(i + 1);
            },
            [&] {
                const EndOfProgress end{second};
                Followed others(&first);
                for (std::size_t i = 0; i < steps; ++i)
                    others.wait_beyond(i), doubled[i] = 2 * made[i], second.reach(i + 1);
            },
            [&] {
                Followed others(&first, &second);
                for (std::size_t i = 0; i < steps; ++i) others.wait_beyond(i), last[i] = made[i] + doubled[i];
            });
        for (std::size_t i = 0; i < steps; ++i) EXPECT_EQ(last[i], 3 * (i + 1));
    }
}

TEST(Followed, WaitsForTheSlowerOfTwo) {
    Progress first, second;
    first.end();
    Followed both(&first, &second);
    std::atomic<bool> waited = false;
    std::thread follower([&] {
        both.wait_beyond(4);
        waited = true;
    });
    second.reach(4);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_FALSE(waited);
    second.reach(5);
    follower.join();
    EXPECT_TRUE(waited);
}

TEST(ParallelFor, AnExceptionOfAnyPieceReachesTheCallerWhenAllPiecesAreDone) {
    for (const unsigned threads : {1u, 2u, 4u}) {
        const ThreadPool pool(threads);
        for (std::size_t failing = 0; failing < 4; ++failing) {
            std::atomic<std::size_t> done = 0;
            auto body = [&](std::size_t begin, std::size_t end) {
                done += end - begin;
                if (begin <= failing * 25 && failing * 25 < end) throw std::bad_alloc();
            };
            EXPECT_THROW(parallel_for(100, pool, 1, body), std::bad_alloc);
            EXPECT_EQ(done, 100u);
        }
    }
}

TEST(ParallelFor, WhereAllPiecesThrowOneExceptionReachesTheCaller) {
    auto body = [](std::size_t, std::size_t) { throw std::length_error("too long"); };
    EXPECT_THROW(parallel_for(1000, ThreadPool(8), 1, body), std::length_error);
}

TEST(ParallelInvoke, AnExceptionOfEitherReachesTheCaller) {
    auto nothing = [] {};
    auto failing = [] { throw std::bad_alloc(); };
    for (const unsigned threads : {1u, 2u}) {
        const ThreadPool pool(threads);
        EXPECT_THROW(parallel_invoke(pool, failing, nothing), std::bad_alloc);
        EXPECT_THROW(parallel_invoke(pool, nothing, failing), std::bad_alloc);
        EXPECT_THROW(parallel_invoke(pool, failing, failing), std::bad_alloc);
    }
}

TEST(ParallelFor, NestedLoopsEndOnAnyNumberOfThreads) {
    for (const unsigned threads : {1u, 2u, 3u, 8u}) {
        const ThreadPool pool(threads);
        std::atomic<int> calls = 0;
        for (int i = 0; i < 50; ++i)
            parallel_for(8, pool, 1, [&](std::size_t begin, std::size_t end) {
                for (; begin < end; ++begin)
                    parallel_for(8, pool, 1, [&](std::size_t from, std::size_t to) {
                        for (; from < to; ++from)
                            parallel_invoke(
                                pool, [&] { ++calls; }, [&] { ++calls; });
                    });
            });
        EXPECT_EQ(calls, 50 * 8 * 8 * 2);
    }
}

TEST(ParallelFor, DoesEverythingWithAnyRunner) {
    for (const auto& runner : {TaskRunner(in_order), TaskRunner(in_reverse), TaskRunner(on_threads_of_their_own)}) {
        const ThreadPool pool(4, runner);
        std::vector<int> calls(1000);
        parallel_for(calls.size(), pool, 1, [&](std::size_t begin, std::size_t end) {
            for (; begin < end; ++begin) ++calls[begin];
        });
        EXPECT_EQ(calls, std::vector<int>(1000, 1));
    }
}

TEST(ParallelFor, HandsARunnerOneTaskForEachThread) {
    std::vector<std::size_t> asked;
    const ThreadPool pool(3, [&](std::size_t tasks, const std::function<void(std::size_t)>& task) {
        asked.push_back(tasks);
        in_order(tasks, task);
    });
    parallel_for(1000, pool, 1, [](std::size_t, std::size_t) {});
    parallel_for(2, pool, 1, [](std::size_t, std::size_t) {});
    parallel_for(2, pool, 5, [](std::size_t, std::size_t) {});  // too small to be cut into pieces
    EXPECT_EQ(asked, (std::vector<std::size_t>{3, 2}));
}

TEST(ParallelFor, ARunnerThatFailsLeavesTheWorkToTheCallerAndItsExceptionReachesIt) {
    const ThreadPool pool(4, [](std::size_t, const std::function<void(std::size_t)>&) { throw std::bad_alloc(); });
    std::atomic<std::size_t> done = 0;
    auto body = [&](std::size_t begin, std::size_t end) { done += end - begin; };
    EXPECT_THROW(parallel_for(100, pool, 1, body), std::bad_alloc);
    EXPECT_EQ(done, 100u);
}

TEST(ThreadPool, RunsEveryTaskOnce) {
    for (const unsigned threads : {1u, 2u, 5u}) {
        const auto run = thread_pool(threads);
        for (const std::size_t tasks : {0u, 1u, 2u, 3u, 100u}) {
            std::vector<std::atomic<int>> calls(tasks);
            run(tasks, [&](std::size_t t) { ++calls[t]; });
            for (const auto& c : calls) EXPECT_EQ(c, 1);
        }
    }
}

TEST(ThreadPool, StartsItsThreadsOnceAndEndsThemWithItsLastCopy) {
    const std::size_t before = threads_of_this_process();
    {
        const ThreadPool pool(3);
        EXPECT_EQ(threads_of_this_process(), before) << "none before there is work";
        const auto copy = pool;
        for (int i = 0; i < 1000; ++i) {
            parallel_for(100, copy, 1, [](std::size_t, std::size_t) {});
            ASSERT_EQ(threads_of_this_process(), before + 2);
        }
    }
    EXPECT_TRUE(comes_to_threads(before)) << threads_of_this_process() << " threads are left of " << before;
}

TEST(ThreadPool, UsesNoProcessorTimeBetween) {
    const ThreadPool pool(4);
    parallel_for(100, pool, 1, [](std::size_t, std::size_t) {});
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const double before = processor_seconds();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_LT(processor_seconds() - before, 0.03);
}

TEST(ThreadPool, TheCallerDoesWhatNoOtherThreadHasBegun) {
    const auto run = thread_pool(2);
    std::atomic<bool> release = false;
    std::latch both_busy(2);
    std::thread first_caller([&] {
        run(2, [&](std::size_t) {
            both_busy.count_down();
            release.wait(false);
        });
    });
    both_busy.wait();  // the pool's thread has nothing to offer until `release`
    int calls = 0;
    run(10, [&](std::size_t) { ++calls; });
    EXPECT_EQ(calls, 10);
    release = true;
    release.notify_all();
    first_caller.join();
}

TEST(ThreadPool, SeveralThreadsMayUseItAtOnce) {
    const auto runner = thread_pool(3);
    std::vector<std::size_t> sums(4);
    std::vector<std::thread> callers;
    for (auto& sum : sums)
        callers.emplace_back([&] {
            const ThreadPool pool(3, runner);
            for (int i = 0; i < 200; ++i) {
                std::atomic<std::size_t> found = 0;
                parallel_for(100, pool, 1, [&](std::size_t begin, std::size_t end) {
                    for (; begin < end; ++begin) found += begin;
                });
                sum += found;
            }
        });
    for (auto& caller : callers) caller.join();
    EXPECT_EQ(sums, std::vector<std::size_t>(4, 200 * 4950));
}

TEST(ThreadCount, ZeroIsOnePerCore) {
    EXPECT_GE(thread_count(0), 1u);
    EXPECT_EQ(thread_count(3), 3u);
}

}  // namespace
}  // namespace htvm::internal
