// A unix socket that takes lines of text and answers each with a line.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "buses/error.hpp"

namespace axisd::simulation {

/// Serves up to 16 clients at a time on a thread of its own until destroyed; then the socket is removed. More
/// wait until one of them leaves.
class ControlSocket {
 public:
  /// One command to its reply, without line ends. Thread: the socket's.
  using Handler = std::function<std::string(std::string_view)>;

  /// Replaces a socket left behind at `path`. "@NAME" is a name of Linux's instead, without a file: its
  /// clients must belong to this process's user or be root. Errors: the path cannot be bound.
  static Result<std::unique_ptr<ControlSocket>> open(std::string path, Handler handler);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

 private:
  struct Client {
    int socket = -1;
    std::string input;
  };
  ControlSocket(std::string path, Handler handler);
  [[nodiscard]] bool is_abstract() const { return path_.starts_with('@'); }
  Result<void> listen();
  void run();
  bool let_in();
  bool serve(Client& client);

  std::string path_;
  Handler handler_;
  int listener_ = -1, wake_fd_ = -1;
  std::vector<Client> clients_;  ///< thread: the socket's
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace axisd::simulation
