// One client's WatchAxes stream.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>
#include <grpcpp/support/slice.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "api/server/services.hpp"

namespace axisd::server {

/// Writes batches one at a time and owes its reader at most one: while a write is pending, later ticks only
/// leave the mark "owed", and the newest values are written when the reader has caught up.
///
///            write()               OnWriteDone
///     idle ----------> writing ------------------> idle
///                         | owe()                   ^
///                         v          OnWriteDone    |
///                       owed  ----------------------+--> on_ready: the hub writes the newest batch
///       close(), or a write that failed: closing (after the pending write) --> Finish; final
///
/// Thread: reply, except OnWriteDone, OnCancel, OnDone and close(), which gRPC's threads call.
class WatchStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                          public OpenCall,
                          public std::enable_shared_from_this<WatchStream> {
 public:
  using Ready = std::function<void(const std::shared_ptr<WatchStream>&)>;

  /// `on_ready` runs on the reply thread when a batch is owed and can be written.
  WatchStream(const Services& services, grpc::CallbackServerContext* context, Admission::Ticket ticket,
              std::string instance_id, Ready on_ready);

  /// Takes gRPC's share of the stream. False: the server is shutting down.
  [[nodiscard]] bool open();

  [[nodiscard]] bool idle() const { return state_.load(std::memory_order_acquire) == State::idle; }
  [[nodiscard]] bool owes() const { return owes_; }
  /// Ends here are final: the hub forgets the stream.
  [[nodiscard]] bool ended() const { return finished_; }

  /// Sends tick and drop count with `axes`, the serialised AxisStates shared with other streams. Only while
  /// idle.
  void write(const grpc::Slice& axes, TimePoint now);
  /// Marks one batch as owed, or counts a drop if one is owed already. False: it became idle, write instead.
  [[nodiscard]] bool owe();
  /// Cancels a stream whose reader has not read for `limit`; one that is being closed gets 100 ms.
  void cancel_if_stalled(TimePoint now, Duration limit);

  void close(const grpc::Status& status) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  enum class State : std::uint8_t { idle, writing, owed, closing };

  void begin_close(const grpc::Status& status);
  void finish();

  const std::shared_ptr<ReplyThread> reply_;
  const std::shared_ptr<OpenCalls> calls_;
  OpenCalls::Judge judge_;                      ///< until open()
  grpc::CallbackServerContext* const context_;  ///< valid until Finish was called
  Admission::Ticket ticket_;
  const std::string instance_id_;
  const Ready on_ready_;
  std::atomic<State> state_{State::idle};
  grpc::ByteBuffer buffer_;  ///< of the pending write
  TimePoint write_began_{};
  std::uint64_t tick_ = 0, dropped_ = 0;
  bool owes_ = false;
  bool cancelled_ = false;
  bool finished_ = false;
  std::optional<grpc::Status> closing_with_;
  std::shared_ptr<WatchStream> self_;  ///< gRPC's share, until OnDone
};

}  // namespace axisd::server
