#pragma once

#include <pthread.h>

#include <csignal>
#include <functional>
#include <thread>

namespace axisd::store {

/// Starts a thread that takes no signals: those belong to the main thread. `name`: by which top and gdb show
/// it, of 15 characters at most.
inline std::thread start_thread(const char* name, std::function<void()> body) {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::move(body));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  pthread_setname_np(thread.native_handle(), name);
  return thread;
}

}  // namespace axisd::store
