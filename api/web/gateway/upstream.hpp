// The daemon, as the gateway is connected to it.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "api/web/gateway/call.hpp"
#include "api/web/gateway/lane_state.hpp"
#include "api/web/gateway/person.hpp"
#include "api/web/gateway/rates.hpp"
#include "api/web/gateway/settings.hpp"
#include "buses/error.hpp"

namespace axisd::web {

/// Two connections with the gateway's own certificate: what pages ask for goes to the main address, what they
/// ask for over their lanes to the daemon's stop lane, where nothing overtakes anything. They are made anew
/// whenever they are lost. Thread: the executor's.
class Upstream {
 public:
  using Done = std::function<void(const CallStatus&, const std::string& response)>;

  /// Blocks for the disk. Errors: invalid_argument (certificates that cannot be read).
  [[nodiscard]] static Result<std::unique_ptr<Upstream>> make(boost::asio::any_io_executor executor,
                                                              const Clock& clock,
                                                              const DaemonSettings& settings);

  /// A call at the main address.
  [[nodiscard]] std::shared_ptr<Call> start(const std::string& path, std::string_view message,
                                            const Person& person, std::optional<Duration> timeout,
                                            Call::Events events);
  /// A call of a page's lane. Where the stop lane cannot be reached, stops go to the main address, and
  /// whatever starts or renews something is refused. `done` is called later, once.
  void ask(LaneMethod method, std::string_view message, const Person& person, Duration timeout, Done done);

  /// Connects where that has been lost. To be called every second or so: gRPC connects only while somebody
  /// asks, and looks at its sockets only once there was a call.
  void stay_connected();
  /// Empty: everything can be asked for.
  [[nodiscard]] std::string trouble() const;
  /// Calls that are not over.
  [[nodiscard]] int open() const { return open_; }

 private:
  struct Link {
    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<grpc::GenericStub> stub;
    std::string probe{};  ///< a call that changes nothing
    bool probing = false;
  };
  Upstream(boost::asio::any_io_executor executor, const Clock& clock, const DaemonSettings& settings,
           const std::shared_ptr<grpc::ChannelCredentials>& trusted);
  void ask_at(Link& link, std::string path, std::string_view message, const Person& person, Duration timeout,
              Done done);

  boost::asio::any_io_executor executor_;
  const Clock& clock_;
  DaemonSettings settings_;
  Link main_, lane_;
  int open_ = 0, at_lane_ = 0;
  Rates moves_;
  Rate stops_;  ///< at the stop lane
};

}  // namespace axisd::web
