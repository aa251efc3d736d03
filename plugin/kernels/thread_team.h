// Threads that run one function side by side and meet at barriers.
#pragma once

#include <atomic>
#include <cstdint>
#include <system_error>
#include <thread>
#include <vector>

class ThreadTeam {
 public:
  explicit ThreadTeam(int members) : members(members) {}

  const int members;

  // Wait for all. A barrier is passed twice a minimiser step, every 0.1 ms: spin, and let others in only after a while.
  void meet()
  {
    if (members == 1) return;
    const std::int64_t round = rounds.load(std::memory_order_acquire);
    if (arrived.fetch_add(1, std::memory_order_acq_rel) + 1 == members) {
      arrived.store(0, std::memory_order_relaxed);
      rounds.fetch_add(1, std::memory_order_acq_rel);
      return;
    }
    for (int spins = 0; rounds.load(std::memory_order_acquire) == round; ++spins)
      if (spins > 2000) std::this_thread::yield();
  }

  // Run work(0) .. work(members - 1), which must not throw. False: no thread could be started, and nothing has run.
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
    } catch (const std::system_error &) {
      start.store(-1, std::memory_order_release);
    }
    const bool started = start.load() > 0;
    if (started) work(0);
    for (auto &other : others) other.join();
    return started;
  }

 private:
  std::atomic<int> arrived{0};
  std::atomic<std::int64_t> rounds{0};
};
