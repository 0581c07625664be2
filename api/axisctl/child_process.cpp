#include "api/axisctl/child_process.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/signalfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "api/axisctl/error.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX leaves declaring it to the program

namespace axisd::axisctl {
namespace {

sigset_t forwarded() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

ChildProcess::ChildProcess() {
  const auto set = forwarded();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  signals_ = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  if (signals_ < 0) throw std::system_error(errno, std::generic_category(), "signalfd");
}

ChildProcess::~ChildProcess() {
  const auto set = forwarded();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  close(signals_);
  if (ended_ >= 0) close(ended_);
}

void ChildProcess::start(const std::vector<std::string>& words,
                         const std::vector<std::pair<std::string, std::string>>& variables) {
  for (const auto& [name, value] : variables) setenv(name.c_str(), value.c_str(), 1);
  std::vector<char*> arguments;
  for (const auto& word : words)
    arguments.push_back(const_cast<char*>(word.c_str()));  // NOLINT: as C wants it
  arguments.push_back(nullptr);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  const int failed = posix_spawnp(&pid_, arguments.front(), nullptr, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  if (failed != 0)
    throw Failure(ExitCode::usage, fmt::format("cannot run '{}': {}", words.front(), std::strerror(failed)));
  ended_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
  if (ended_ < 0) throw std::system_error(errno, std::generic_category(), "pidfd_open");
}

std::optional<int> ChildProcess::wait_for(std::chrono::milliseconds limit) {
  std::array<pollfd, 2> fds{{{ended_, POLLIN, 0}, {signals_, POLLIN, 0}}};
  poll(fds.data(), fds.size(), static_cast<int>(limit.count()));
  if ((fds[1].revents & POLLIN) != 0) {
    signalfd_siginfo signal{};
    if (read(signals_, &signal, sizeof signal) == sizeof signal && signal.ssi_signo == SIGTERM)
      kill(pid_, SIGTERM);
  }
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace axisd::axisctl
