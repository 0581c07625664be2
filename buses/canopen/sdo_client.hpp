// SDO client of every node of a network: one transfer at a time per node, many nodes in parallel.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "buses/can/port.hpp"
#include "buses/canopen/late_replies.hpp"
#include "buses/canopen/sdo_transfer.hpp"
#include "buses/class_statistics.hpp"
#include "buses/signal.hpp"

namespace axisd::canopen {

struct SdoSettings {
  Duration timeout = std::chrono::milliseconds(100);  ///< from the end of a request frame to its reply
  /// A stop cuts another transfer of its node this long after that one's last frame: a server that is still
  /// busy with it may lose what comes sooner.
  Duration turnaround = std::chrono::milliseconds(10);
  Duration transfer_limit = std::chrono::seconds(2);  ///< of a whole transfer, segments and all
  std::size_t upload_limit = 4096;                    ///< bytes
  std::size_t queue_limit = 64;                       ///< waiting requests per node; stops: twice as many
  int upload_attempts = 2;
};

struct SdoOptions {
  TransactionClass transaction_class = TransactionClass::parameters;
  TimePoint deadline = TimePoint::max();  ///< not begun after this
  MotionGuard guard{};                    ///< for motion: asked by the port when a frame is handed over
  std::optional<Duration> timeout{};      ///< of this node's answers; nothing: the settings'
  std::optional<Duration> transfer_limit{};
  /// Attempts while there is no reply. Nothing: the settings' for uploads, one for downloads, because a
  /// download may trigger something (M8). More only for writes that may happen twice.
  std::optional<int> attempts{};
  std::optional<std::size_t> upload_limit{};  ///< bytes
};

struct SdoAnswer {
  Bytes bytes;                  ///< of an upload
  bool size_indicated = false;  ///< the server said how many bytes count; else 4 came
  /// Stops only: the reply may be that of an earlier request for the same object, which had timed out. Read
  /// back.
  bool ambiguous = false;
  TimePoint sent_at{};  ///< end of the first frame
  TimePoint answered_at{};
};

/// Counters since start.
struct SdoCounters {
  std::uint64_t transfers = 0, aborted_by_node = 0, timeouts = 0, protocol_errors = 0,
                unexpected_replies = 0,  ///< discarded: nobody waited for them
      resynchronisations = 0, cut_by_stop = 0, rejected = 0;
  SdoCounters& operator+=(const SdoCounters& other);
};

/// Thread: core.
///
/// A node that did not answer gets an abort and is held back: its next request for an object whose reply may
/// still come is preceded by a read of another object (see LateReplies). Requests for other objects go at
/// once, and other nodes are not concerned. A stop is never held back; its answer then says `ambiguous`.
class SdoClient {
 public:
  SdoClient(Executor executor, Clock& clock, can::Port& port, SdoSettings settings = {});
  ~SdoClient();
  SdoClient(const SdoClient&) = delete;
  SdoClient& operator=(const SdoClient&) = delete;

  /// Reads an object. Errors: refused and its kin (`native_code` is the abort code), no_reply, out_of_range
  /// (too long), superseded, expired, bus_down, rebooted, busy, invalid_argument.
  Task<Result<SdoAnswer>> upload(std::uint8_t node, Object object, SdoOptions options = {});
  /// Writes an object. With Outcome::unknown it may have been written.
  Task<Result<SdoAnswer>> download(std::uint8_t node, Object object, Bytes bytes, SdoOptions options = {});

  /// A frame with the SDO reply identifier of `node`.
  void on_reply(std::uint8_t node, const can::ReceivedFrame& frame);
  /// The node booted: what was under way or waited ends as `rebooted`, but for stops that wait.
  void on_boot(std::uint8_t node);
  /// After the port's state changed: without a link everything ends.
  void on_port(const can::PortState& state);
  /// Ends queued motion whose gate was raised. Called for each stop.
  void purge_superseded(std::uint8_t node);
  /// Ends everything; nothing is begun any more.
  void close();

  /// Of all nodes.
  [[nodiscard]] SdoCounters counters() const;
  /// Of one node; all 0 if nothing was ever asked of it.
  [[nodiscard]] SdoCounters counters(std::uint8_t node) const;
  /// Of all nodes, without the reads that only bring a node in step again.
  [[nodiscard]] StatisticsByClass classes() const;
  /// A request of a stop or a motion is under way, at some node.
  [[nodiscard]] bool urgent() const;
  /// More replies come from this node-ID than were asked for: two nodes have it.
  [[nodiscard]] bool answers_twice(std::uint8_t node) const;
  [[nodiscard]] const SdoSettings& settings() const { return settings_; }

 private:
  struct Request;
  struct Active;
  struct Node;
  using RequestPtr = std::unique_ptr<Request>;

  Task<Result<SdoAnswer>> transact(std::uint8_t node, RequestPtr request);
  Node& node(std::uint8_t id);
  void on_unexpected(Node& node);
  void pump(Node& node);
  void reap(Node& node);
  void begin(Node& node, RequestPtr request);
  void send(Node& node, const SdoData& data);
  void send_abort(Node& node, const SdoData& data, TransactionClass transaction_class);
  void on_sent(std::uint8_t id, std::uint64_t frame_id, const can::SendResult& result,
               const can::Frame& frame);
  void on_due(Node& node);
  void cut(Node& node);
  void fail_active(Node& node, Error error, bool may_retry);
  void finish(Node& node, Result<SdoAnswer> result);
  void complete(Node& node, RequestPtr request, Result<SdoAnswer> result);
  [[nodiscard]] std::size_t waiting(TransactionClass transaction_class) const;
  void count_drop(const Request& request, Reason why);
  void count_begin(const Active& active);
  /// `error`: nullptr: it was answered.
  void count_end(const Active& active, TimePoint at, const Error* error);
  void end_queued(Node& node, const std::function<std::optional<Error>(const Request&)>& why);
  void arm(Node& node);

  Executor executor_;
  Clock* clock_;
  can::Port* port_;
  SdoSettings settings_;
  std::map<std::uint8_t, std::unique_ptr<Node>> nodes_;
  SdoCounters others_;  ///< of nodes of which nothing was asked yet
  StatisticsByClass classes_;
  std::uint64_t last_frame_id_ = 0;
  bool closed_ = false;
};

}  // namespace axisd::canopen
