// A team of threads runs one function side by side. They wait for each other where they meet.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

class ThreadTeam {
 public:
  explicit ThreadTeam(int members) : members(members) {}

  const int members;

  // Waits for all threads, awake for 20 microseconds, then asleep for the sake of other programs.
  void meet()
  {
    if (members == 1) return;
    const std::int64_t round = rounds.load();
    if (arrived.fetch_add(1) + 1 == members) {
      arrived.store(0);
      rounds.fetch_add(1);
      if (asleep.load() > 0) {
        const std::lock_guard<std::mutex> lock(door);
        bell.notify_all();
      }
      return;
    }
    for (int spins = 0; spins < 20000; ++spins)
      if (rounds.load(std::memory_order_acquire) != round) return;
    asleep.fetch_add(1);
    {
      std::unique_lock<std::mutex> lock(door);
      bell.wait(lock, [&] { return rounds.load() != round; });
    }
    asleep.fetch_sub(1);
  }

  // Runs work(0) .. work(members - 1), which must not throw; false: threads or memory lack, and
  // none has run.
  template <class Work> bool run(Work work)
  {
    std::vector<std::thread> others;
    std::atomic<int> start{0};
    try {
      others.reserve(members - 1);
      for (int k = 1; k < members; ++k)
        others.emplace_back([&, k] {
          while (start.load(std::memory_order_acquire) == 0) std::this_thread::yield();
          if (start.load(std::memory_order_acquire) > 0) work(k);
        });
      start.store(1, std::memory_order_release);
    } catch (...) {  // those that wait must end, whatever it is
      start.store(-1, std::memory_order_release);
    }
    const bool started = start.load() > 0;
    if (started) work(0);
    for (auto &other : others) other.join();
    return started;
  }

 private:
  std::mutex door;
  std::condition_variable bell;
  std::atomic<int> arrived{0}, asleep{0};
  std::atomic<std::int64_t> rounds{0};
};
