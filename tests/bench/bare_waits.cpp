// What the computer itself does to whoever waits: a thread on each processor that does nothing but wake each
// millisecond, before all ordinary threads. When it is ended (SIGTERM) it prints each wake that was late by
// more than 0.1 ms as "WHEN LATE": the monotonic time at which it was due, and its delay, in ns.
//   bench_bare_waits          needs the right to real-time priority, without which it ends with 1
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <functional>
#include <list>
#include <thread>
#include <vector>

namespace {

constexpr long long ns_per_second = 1'000'000'000;
constexpr long long period = 1'000'000;
constexpr long long worth_telling = 100'000;

struct Late {
  long long due, delay;
};

struct Waiter {
  int processor;
  std::vector<Late> late{};
  std::thread thread{};
};

std::atomic<bool> ending{false};

long long now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * ns_per_second + t.tv_nsec;
}

void wait_on(Waiter& waiter) {
  cpu_set_t here;
  CPU_ZERO(&here);
  CPU_SET(waiter.processor, &here);
  pthread_setaffinity_np(pthread_self(), sizeof here, &here);
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  for (auto due = now() + period; !ending; due += period) {
    const timespec t{.tv_sec = due / ns_per_second, .tv_nsec = due % ns_per_second};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
    const auto delay = now() - due;
    if (delay > worth_telling) waiter.late.push_back({due, delay});
    due += delay / period * period;  // one that was missed is not made up for
  }
}

}  // namespace

int main() {
  sigset_t end;
  sigemptyset(&end);
  sigaddset(&end, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &end, nullptr);
  const sched_param first{.sched_priority = 1};
  if (sched_setscheduler(0, SCHED_FIFO, &first) != 0) return 1;
  cpu_set_t allowed;
  sched_getaffinity(0, sizeof allowed, &allowed);
  std::list<Waiter> waiters;
  for (int processor = 0; processor < CPU_SETSIZE; ++processor)
    if (CPU_ISSET(processor, &allowed)) {
      auto& waiter = waiters.emplace_back(processor);
      waiter.thread = std::thread(wait_on, std::ref(waiter));  // inherits the priority
    }
  int got = 0;
  sigwait(&end, &got);
  ending = true;
  for (auto& waiter : waiters) {
    waiter.thread.join();
    for (const auto& [due, delay] : waiter.late) std::printf("%lld %lld\n", due, delay);
  }
}
