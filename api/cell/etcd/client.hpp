// etcd, as the registry needs it: one endpoint at a time.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/security/credentials.h>

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/cell/ask.hpp"
#include "api/cell/etcd/etcd.pb.h"
#include "api/cell/etcd/keys.hpp"
#include "api/cell/kept.pb.h"

namespace axisd::cell::etcd {

/// A key that can be compared and replaced.
struct Versioned {
  std::string value;
  std::int64_t revision = 0;  ///< of its last change; 0: there is no such key
};

/// Thread: core.
class Client {
 public:
  /// What comes of it; of the endpoint that was looked at last alone.
  struct Events {
    std::function<void(std::vector<kept::Registration>)> listed;  ///< then the watch begins
    std::function<void(const std::string& name, std::optional<kept::Registration>)> changed;
    std::function<void(const Versioned&)> stop_all;  ///< as it is now; with listed, and at each change
    std::function<void()> heard;
    std::function<void(std::int64_t lease)> granted;
    std::function<void()> written;
    std::function<void(const kept::Registration& holder)> held;
    std::function<void(bool alive)> kept_alive;
    std::function<void(std::string why)> lost;
  };
  /// What became of a key that was to be replaced.
  struct Replaced {
    std::optional<Versioned> other{};  ///< it had been changed before: to this
    std::string error{};               ///< it is not known, or was not done: why
  };

  Client(boost::asio::any_io_executor core, std::vector<std::string> endpoints,
         std::shared_ptr<grpc::ChannelCredentials> trusted, std::string_view cell, Events events);
  ~Client();
  Client(const Client&) = delete;

  /// Others than before, from the next look() on.
  void trust(std::shared_ptr<grpc::ChannelCredentials> trusted) { trusted_ = std::move(trusted); }
  void look(std::size_t endpoint);
  void leave();
  void grant(Duration ttl);
  /// The machine's own key, where nobody has it, or the same computer.
  void write(std::int64_t lease, const kept::Registration& own);
  void keep_alive(std::int64_t lease);
  void ask_progress();
  /// Gives the lease back: the key goes with it. `done`: called at any rate.
  void revoke(std::int64_t lease, std::function<void()> done);
  /// Replaces the key of StopAll, if it is still as of `revision`.
  void replace_stop_all(std::string value, std::int64_t revision, std::function<void(Replaced)> done);

 private:
  /// Asks the present endpoint. `done` is not called once another one is looked at; errors end it.
  template <class Response, class Done>
  void ask_endpoint(const char* path, const google::protobuf::MessageLite& request, Done done);
  void list();
  void watch_from(std::int64_t revision);
  void on_watched(const grpc::ByteBuffer& bytes);
  void on_event(const etcdserverpb::Event& event);
  void on_written(std::int64_t lease, const kept::Registration& own,
                  const etcdserverpb::TxnResponse& response);
  void put(std::int64_t lease, const kept::Registration& own, etcdserverpb::Compare condition);
  void lose(std::string why);

  boost::asio::any_io_executor core_;
  const std::vector<std::string> endpoints_;
  std::shared_ptr<grpc::ChannelCredentials> trusted_;
  const Keys keys_;
  const Events events_;
  /// The present look; who asks holds it weakly: what comes of an earlier one is nobody's.
  struct Look {
    std::string endpoint;
    std::shared_ptr<grpc::Channel> channel;
    std::shared_ptr<Talk> watch, lease;
  };
  std::shared_ptr<Look> look_;
};

}  // namespace axisd::cell::etcd
