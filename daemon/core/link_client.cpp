#include "daemon/core/link_client.hpp"

#include <fmt/format.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <string_view>
#include <utility>

namespace axisd::core {
namespace {

using boost::asio::local::stream_protocol;
using Code = boost::system::error_code;

constexpr std::size_t longest_answer = 1024;
constexpr std::string_view by_hand =
    "enable axisd-link.socket and name the interface in /etc/axisd/links, or set the link down and up by "
    "hand";

}  // namespace

/// Whatever happens first (answer, error, end of patience) ends it.
class LinkClient::Request : public std::enable_shared_from_this<Request> {
 public:
  Request(const Executor& executor, std::string path, std::string line, Done done)
      : executor_(executor),
        socket_(executor),
        path_(std::move(path)),
        line_(std::move(line)),
        done_(std::move(done)) {}

  void start(Clock& clock) {
    timer_ = clock.call_at(clock.now() + patience, [this] {
      end(fail(Reason::bus_down, fmt::format("the link helper at {} does not answer", path_),
               "see journalctl -u axisd-link"));
    });
    if (path_.size() >= sizeof(sockaddr_un::sun_path)) return end(unreachable("the path is too long"));
    socket_.async_connect(stream_protocol::endpoint(path_), [self = shared_from_this()](const Code& error) {
      if (self->ended()) return;
      error ? self->end(self->unreachable(error.message())) : self->write();
    });
  }
  [[nodiscard]] bool ended() const { return !done_; }
  /// Calls nobody any more.
  void abandon() {
    done_ = {};
    timer_.reset();
    Code ignored;
    socket_.close(ignored);
  }

 private:
  void write() {
    boost::asio::async_write(socket_, boost::asio::buffer(line_),
                             [self = shared_from_this()](const Code& error, std::size_t) {
                               if (self->ended()) return;
                               error ? self->end(self->unreachable(error.message())) : self->read();
                             });
  }
  void read() {
    boost::asio::async_read_until(
        socket_, boost::asio::dynamic_buffer(answer_, longest_answer), '\n',
        [self = shared_from_this()](const Code& error, std::size_t) {
          if (self->ended()) return;
          self->end(error ? self->unreachable("it closed the connection") : self->read_answer());
        });
  }
  [[nodiscard]] Result<void> read_answer() const {
    const auto text = std::string_view(answer_).substr(0, answer_.find('\n'));
    if (text == "ok") return {};
    constexpr std::string_view refused = "error ";
    return fail(
        Reason::bus_down,
        fmt::format("the link helper: {}", text.starts_with(refused) ? text.substr(refused.size()) : text),
        "see journalctl -u axisd-link and /etc/axisd/links");
  }
  [[nodiscard]] Result<void> unreachable(std::string_view why) const {
    return fail(Reason::bus_down, fmt::format("there is no link helper at {}: {}", path_, why),
                std::string(by_hand));
  }
  void end(Result<void> answer) {
    post(executor_, [done = std::exchange(done_, {}), answer = std::move(answer)] { done(answer); });
    abandon();
  }

  Executor executor_;
  stream_protocol::socket socket_;
  std::string path_, line_, answer_;
  Done done_;  ///< empty once it was called
  Clock::Timer timer_;
};

LinkClient::LinkClient(Executor executor, Clock& clock, std::string socket_path)
    : executor_(std::move(executor)), clock_(&clock), path_(std::move(socket_path)) {}

LinkClient::~LinkClient() {
  for (const auto& request : requests_) request->abandon();
}

void LinkClient::ask(std::string line, Done done) {
  std::erase_if(requests_, [](const auto& request) { return request->ended(); });
  requests_.push_back(std::make_shared<Request>(executor_, path_, std::move(line), std::move(done)));
  requests_.back()->start(*clock_);
}

void LinkClient::cycle(const std::string& interface, Done done) {
  ask(fmt::format("cycle {}\n", interface), std::move(done));
}

void LinkClient::check(const std::string& interface, Done done) {
  ask(fmt::format("check {}\n", interface), std::move(done));
}

}  // namespace axisd::core
