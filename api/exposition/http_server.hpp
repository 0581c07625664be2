#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "api/exposition/exposition.hpp"
#include "api/transport/listen.hpp"
#include "buses/asio_clock.hpp"
#include "buses/error.hpp"

namespace axisd::metrics {

/// Serves one page, /metrics, over HTTP/1.1 on a thread of its own. Whatever comes in, it takes a bounded
/// share of the processor, of memory and of descriptors: so many connections at once, so many in a second,
/// each for one request and a short time. Thread: that which made it; the page is made on its own.
class HttpServer {
 public:
  /// Called on the server's thread.
  using Page = std::function<std::shared_ptr<const std::string>(Format)>;
  struct Limits {
    std::size_t connections = 8;
    Duration pause = std::chrono::milliseconds(40);  ///< after one was let in; others wait in the kernel
    Duration request = std::chrono::seconds(2);      ///< until it has come
    Duration response = std::chrono::seconds(5);     ///< until it was taken
  };

  /// Listens on "HOST:PORT"; without `remote` on loopback addresses only. Errors: those of
  /// transport::listen_on().
  static Result<std::unique_ptr<HttpServer>> open(const std::string& listen, bool remote, Page page,
                                                  Limits limits);
  /// Cuts all connections.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;

  [[nodiscard]] int port() const { return port_; }

 private:
  class Session;
  struct Listener {
    boost::asio::posix::stream_descriptor socket;
    Clock::Timer pause{};
  };
  HttpServer(std::vector<transport::ListeningSocket> sockets, Page page, Limits limits);
  void wait(Listener& listener);
  void let_in(Listener& listener);
  void run();

  const Page page_;
  const Limits limits_;
  int port_ = 0;
  boost::asio::io_context io_{1};
  AsioClock clock_{io_};
  std::vector<std::unique_ptr<Listener>> listeners_;
  std::vector<std::weak_ptr<Session>> sessions_;
  std::thread thread_;
};

}  // namespace axisd::metrics
