#pragma once

#include <csignal>
#include <functional>
#include <thread>

namespace axisd::store {

/// Starts a thread that takes no signals: those belong to the main thread.
inline std::thread start_thread(std::function<void()> body) {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::move(body));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace axisd::store
