// The daemon, as the gateway is connected to it.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "api/web/gateway/call.hpp"
#include "api/web/gateway/lane_room.hpp"
#include "api/web/gateway/lane_state.hpp"
#include "api/web/gateway/person.hpp"
#include "api/web/gateway/settings.hpp"
#include "api/web/gateway/shares.hpp"
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
  /// A call of a page's lane. Where the stop lane cannot be reached, or has no room, stops go to the main
  /// address, behind the end of presses that wait for their answers; a press or a renewal is refused. What
  /// starts something that goes on by itself, and releases, go to the main address, or are refused: none of
  /// them waits here for a connection. `done` is called later, once.
  void ask(LaneMethod method, std::string_view message, const Person& person, Duration timeout, Done done);

  /// Connects where that has been lost. To be called every second or so: gRPC connects only while somebody
  /// asks, and looks at its sockets only once there was a call.
  void stay_connected();
  /// Empty: everything can be asked for.
  [[nodiscard]] std::string trouble() const;
  /// Logs when trouble() has changed, and not only for a moment. To be called every second or so.
  void tell_trouble();
  /// Calls that are not over.
  [[nodiscard]] int open() const { return open_; }

 private:
  /// Starts and releases that wait for their answers: of all, and of each person.
  static constexpr int most_starts = 64, most_starts_each = 16;
  struct Link {
    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<grpc::GenericStub> stub;
    std::string probe{};  ///< a call that changes nothing
    bool probing = false;
    std::string why{};  ///< what the last one ended with
  };
  Upstream(boost::asio::any_io_executor executor, const Clock& clock, const DaemonSettings& settings,
           const std::shared_ptr<grpc::ChannelCredentials>& trusted);
  std::shared_ptr<Call> ask_at(Link& link, std::string path, std::string_view message, const Person& person,
                               Duration timeout, Done done);
  [[nodiscard]] const Link* broken() const;
  void note_answer(const CallStatus& status);
  void press(LaneMethod method, std::string_view message, const Person& person, Duration timeout, Done done);
  void start_at_main(LaneMethod method, std::string_view message, const Person& person, Duration timeout,
                     Done done);
  void stop(LaneMethod method, std::string_view message, const Person& person, Duration timeout, Done done);
  void stop_at_main(LaneMethod method, std::string_view message, const Person& person, Duration timeout,
                    Done done);
  /// Of one person; of all: nothing. A press that gRPC holds back would else come behind a stop that took
  /// the other connection.
  void abort_presses(const std::optional<std::string>& who);

  boost::asio::any_io_executor executor_;
  const Clock& clock_;
  DaemonSettings settings_;
  Link main_, lane_;
  int open_ = 0;
  LaneRoom room_;
  Shares starts_{most_starts, most_starts_each};
  struct Press {
    std::string who;
    std::shared_ptr<Call> call;
  };
  std::map<std::uint64_t, Press> presses_;  ///< at the stop lane
  std::uint64_t last_press_ = 0;
  std::string trouble_seen_{}, trouble_told_{};  ///< at the last look; as it was logged last
  bool refusal_told_ = false;                    ///< that the daemon does not let this speak for others
};

}  // namespace axisd::web
