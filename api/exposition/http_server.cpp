#include "api/exposition/http_server.hpp"

#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <exception>
#include <optional>
#include <string_view>
#include <utility>

#include "buses/limited_log.hpp"

namespace axisd::metrics {

namespace beast = boost::beast;
namespace http = boost::beast::http;

namespace {

constexpr std::size_t most_header_bytes = 8192;

/// What a client takes first; Prometheus asks for OpenMetrics by name.
Format format_for(std::string_view accept) {
  return accept.contains("application/openmetrics-text") ? Format::openmetrics : Format::text;
}

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

/// One connection: a request, its answer, the end. Keeps itself until then.
class HttpServer::Session : public std::enable_shared_from_this<Session> {
 public:
  Session(boost::asio::ip::tcp::socket socket, const Page& page, const Limits& limits)
      : stream_(std::move(socket)), page_(&page), limits_(limits) {
    parser_.header_limit(most_header_bytes);
  }

  void start() {
    stream_.expires_after(limits_.request);
    http::async_read_header(stream_, buffer_, parser_,
                            [self = shared_from_this()](beast::error_code error, std::size_t) {
                              if (!error) self->answer();
                            });
  }

 private:
  void answer() {
    const auto& request = parser_.get();
    const auto target = view(request.target());
    const bool known = target.substr(0, target.find('?')) == "/metrics";
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      refuse(http::status::method_not_allowed, "only GET is served here\n");
    else if (!known)
      refuse(http::status::not_found, "the metrics are at /metrics\n");
    else
      answer_with_page(format_for(view(request[http::field::accept])));
    response_.version(request.version() < 11 ? 10 : 11);
    response_.keep_alive(false);
    response_.prepare_payload();
    if (request.method() == http::verb::head) response_.body().clear();
    send();
  }

  void answer_with_page(Format format) {
    response_.result(http::status::ok);
    const auto type = content_type(format);
    response_.set(http::field::content_type, beast::string_view(type.data(), type.size()));
    response_.body() = *(*page_)(format);
  }

  void refuse(http::status status, std::string_view why) {
    response_.result(status);
    response_.set(http::field::content_type, "text/plain; charset=utf-8");
    response_.body() = why;
  }

  void send() {
    stream_.expires_after(limits_.response);
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code, std::size_t) {
      beast::error_code ignored;
      self->stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_both, ignored);
    });
  }

  beast::tcp_stream stream_;
  const Page* page_;
  const Limits limits_;
  beast::flat_static_buffer<most_header_bytes> buffer_;
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

Result<std::unique_ptr<HttpServer>> HttpServer::open(const std::string& listen, bool remote, Page page,
                                                     Limits limits) {
  auto sockets = transport::listen_on(listen, remote);
  if (!sockets) {
    auto error = std::move(sockets).error();
    error.remedy = "check server.metrics.listen, and that nothing else listens there";
    return fail(std::move(error));
  }
  return std::unique_ptr<HttpServer>(new HttpServer(*std::move(sockets), std::move(page), limits));
}

HttpServer::HttpServer(std::vector<transport::ListeningSocket> sockets, Page page, Limits limits)
    : page_(std::move(page)), limits_(limits), port_(sockets.front().port) {
  for (auto& socket : sockets) {
    listeners_.push_back(std::make_unique<Listener>(
        Listener{.socket = boost::asio::posix::stream_descriptor(io_, socket.fd.release())}));
    wait(*listeners_.back());
  }
  thread_ = std::thread([this] {
    pthread_setname_np(pthread_self(), "axisd-metrics");
    run();
  });
}

HttpServer::~HttpServer() {
  io_.stop();
  thread_.join();
}

void HttpServer::run() {
  while (!io_.stopped()) {
    try {
      io_.run();
    } catch (const std::exception& error) {  // no memory: that connection has ended
      log_limited(spdlog::level::err, "metrics", "requests", error.what());
    }
  }
}

void HttpServer::wait(Listener& listener) {
  listener.socket.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                             [this, &listener](const boost::system::error_code& error) {
                               if (!error) let_in(listener);
                             });
}

void HttpServer::let_in(Listener& listener) {
  // First, so that whatever happens here it goes on.
  listener.pause = clock_.call_at(clock_.now() + limits_.pause, [this, &listener] { wait(listener); });
  std::erase_if(sessions_, [](const auto& session) { return session.expired(); });
  if (sessions_.size() >= limits_.connections) return;
  FileDescriptor connection(
      accept4(listener.socket.native_handle(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (connection.get() < 0) return;  // it is gone, or there are no descriptors: again after the pause
  boost::asio::ip::tcp::socket socket(io_);
  beast::error_code error;
  // Of which family it is only matters to who asks for its addresses.
  socket.assign(boost::asio::ip::tcp::v4(), connection.get(), error);
  if (error) return;
  (void)connection.release();
  const auto session = std::make_shared<Session>(std::move(socket), page_, limits_);
  sessions_.push_back(session);
  session->start();
}

}  // namespace axisd::metrics
