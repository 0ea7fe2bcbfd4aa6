// A pool of threads that stay. A call of its runner is a job, which lives on its caller's stack. Whoever is free, first
// of all the caller, takes the next task of a job under the pool's mutex; the caller waits only for tasks that others
// have taken. So a thread that wakes late, as on a busy machine, costs nothing, nested jobs cannot deadlock, and
// nothing is allocated.
#include "core/thread.h"

#include <utility>

#ifdef __STDCPP_THREADS__
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#endif

namespace htvm {
namespace {

using Task = std::function<void(std::size_t)>;

#ifdef __STDCPP_THREADS__

// How long a thread spins for its next task before it sleeps. Sleeping and waking takes 5 to 50 us, so spinning longer
// would gain little and keep the core from others.
constexpr std::chrono::microseconds patience{30};

// Spins until done() is true, at most that long; gives whether it became true.
template <class Done>
bool came_soon(const Done& done) {
    const auto end = std::chrono::steady_clock::now() + patience;
    do
        if (done()) return true;
    while (std::chrono::steady_clock::now() < end);
    return false;
}

// All members except `running` are guarded by the pool's mutex.
struct Job {
    const Task& task;
    std::size_t tasks;
    std::size_t next = 1;                  // the first task that nobody has taken; the caller begins with task 0
    std::atomic<std::size_t> running = 0;  // tasks taken by threads other than the caller's and not finished yet
    bool caller_sleeps = false;
    Job* older = nullptr;  // the next older job that has tasks to take
};

class Pool {
public:
    explicit Pool(std::size_t workers) : most_workers_(workers) {}
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;
    ~Pool() {
        {
            const std::lock_guard lock(mutex_);
            ending_ = true;
        }
        posted_.notify_all();
        for (auto& worker : workers_) worker.join();
    }

    void run(std::size_t tasks, const Task& task) {
        if (tasks > 1 && most_workers_ > 0) {
            Job job{task, tasks};
            post(job);
            task(0);
            for (std::size_t t = next_task(job); t < tasks; t = next_task(job)) task(t);
            await(job);
        } else {
            for (std::size_t t = 0; t < tasks; ++t) task(t);
        }
    }

private:
    void post(Job& job) {
        std::size_t wake = 0;
        {
            const std::lock_guard lock(mutex_);
            start_workers(std::min(most_workers_, job.tasks - 1));
            job.older = std::exchange(newest_, &job);
            open_.store(true, std::memory_order_relaxed);
            wake = std::min(asleep_, job.tasks - 1);
        }
        for (std::size_t i = 0; i < wake; ++i) posted_.notify_one();
    }

    void start_workers(std::size_t wanted) {
        try {
            while (workers_.size() < wanted) workers_.emplace_back([this] { work(); });
        } catch (const std::exception&) {
            // system_error: no thread available; bad_alloc: no memory for one. The caller does the remaining work.
        }
    }

    // The next task, or job.tasks if there is none left. The mutex must be locked.
    std::size_t next_task_locked(Job& job) {
        if (job.next == job.tasks) return job.tasks;
        const std::size_t t = job.next++;
        if (job.next == job.tasks) {
            Job** link = &newest_;
            while (*link != &job) link = &(*link)->older;
            *link = job.older;
            open_.store(newest_ != nullptr, std::memory_order_relaxed);
        }
        return t;
    }

    std::size_t next_task(Job& job) {
        const std::lock_guard lock(mutex_);
        return next_task_locked(job);
    }

    void await(Job& job) {
        const auto finished = [&] { return job.running.load(std::memory_order_acquire) == 0; };
        if (came_soon(finished)) return;
        std::unique_lock lock(mutex_);
        job.caller_sleeps = true;
        finished_.wait(lock, finished);
    }

    // The newest job first: of nested jobs, the outer ones wait for it.
    void work() {
        std::unique_lock lock(mutex_);
        while (!ending_) {
            if (newest_) {
                Job& job = *newest_;
                const std::size_t t = next_task_locked(job);
                job.running.fetch_add(1, std::memory_order_relaxed);
                lock.unlock();
                job.task(t);
                lock.lock();
                if (job.caller_sleeps) finished_.notify_all();
                job.running.fetch_sub(1, std::memory_order_release);  // the job may no longer exist after this
                continue;
            }
            lock.unlock();
            came_soon([&] { return open_.load(std::memory_order_relaxed); });
            lock.lock();
            ++asleep_;
            posted_.wait(lock, [&] { return newest_ || ending_; });
            --asleep_;
        }
    }

    const std::size_t most_workers_;
    std::mutex mutex_;
    std::condition_variable posted_, finished_;  // signalled when a job is posted, and when its last task is finished
    std::vector<std::thread> workers_;
    Job* newest_ = nullptr;           // the newest job that has tasks to take
    std::atomic<bool> open_ = false;  // whether there is such a job; readable without the mutex
    std::size_t asleep_ = 0;
    bool ending_ = false;
};

#endif

}  // namespace

#ifdef __STDCPP_THREADS__

unsigned internal::thread_count(unsigned requested) {
    return requested > 0 ? requested : std::max(1u, std::thread::hardware_concurrency());
}

TaskRunner thread_pool(unsigned threads) {
    return [pool = std::make_shared<Pool>(internal::thread_count(threads) - 1)](std::size_t tasks, const Task& task) {
        pool->run(tasks, task);
    };
}

#else

unsigned internal::thread_count(unsigned) { return 1; }

TaskRunner thread_pool(unsigned) {
    return [](std::size_t tasks, const Task& task) {
        for (std::size_t t = 0; t < tasks; ++t) task(t);
    };
}

#endif

internal::ThreadPool::ThreadPool(unsigned requested, TaskRunner runner) {
    const unsigned count = thread_count(requested);
    if (count == 1) return;
    runner_ = std::make_shared<const TaskRunner>(runner ? std::move(runner) : thread_pool(count));
    count_ = count;
}

}  // namespace htvm
