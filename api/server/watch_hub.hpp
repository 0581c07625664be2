// One tick for all watchers.
#pragma once

#include <google/protobuf/field_mask.pb.h>

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "api/server/watch_stream.hpp"
#include "axisd/v1/axis_service.pb.h"

namespace axisd::server {

/// What a stream carries, and how often. Streams of the same make share their batches.
struct WatchScope {
  std::vector<std::string> axes;  ///< in the machine's order; none: all that there are
  Duration period;
  google::protobuf::FieldMask fields{};  ///< of AxisState, in canonical form; empty: all
};

/// Sends every WatchAxes stream its batches. Streams of the same scope form a group: each of its batches is
/// serialised once and shared. Ticks lie on multiples of the period, so that groups wake the
/// thread together.
///
/// Thread: reply, except open() and published().
class WatchHub {
 public:
  WatchHub(Machine& machine, std::shared_ptr<ReplyThread> reply, Duration stalled_reader_limit)
      : machine_(machine), reply_(std::move(reply)), stalled_reader_limit_(stalled_reader_limit) {}

  /// Begins a stream; its first batch is sent at once. nullptr: the server is shutting down. Thread: gRPC.
  grpc::ServerWriteReactor<grpc::ByteBuffer>* open(const Services& services,
                                                   grpc::CallbackServerContext* context,
                                                   Admission::Ticket ticket, WatchScope scope);

  /// New snapshots exist: a batch made before is not given to a stream that begins now. Thread: any.
  void published() { published_.fetch_add(1, std::memory_order_release); }

  /// Sends what is due; returns when it wants to be called again.
  TimePoint tick(TimePoint now);

  /// Batches serialised since the start. Thread: any.
  [[nodiscard]] std::uint64_t batches_serialised() const { return batches_.load(std::memory_order_relaxed); }

 private:
  struct Shown {
    AxisSnapshotPtr snapshot{};
    v1::AxisState* state = nullptr;  ///< made of it, in the group's message
  };
  struct Group {
    WatchScope scope;
    TimePoint due;
    std::vector<std::shared_ptr<WatchStream>> streams;
    v1::WatchAxesResponse message{};  ///< as of the last batch
    std::vector<Shown> shown{};
    grpc::Slice batch;  ///< its AxisStates, serialised
    TimePoint batch_made{};
    std::uint64_t batch_published = 0;
  };

  void add(const std::shared_ptr<WatchStream>& stream, WatchScope scope);
  void run(Group& group, TimePoint now);
  void pay(const std::shared_ptr<WatchStream>& stream);
  void refresh(Group& group, TimePoint now);
  static void show(Shown& shown, AxisSnapshotPtr snapshot, const WatchScope& scope, TimePoint now);
  /// Ends streams of an axis that the configuration no longer has. True: there is none.
  bool end_without(Group& group);
  void serialise(Group& group, TimePoint now);
  void look_for_stalls(TimePoint now);

  Machine& machine_;
  const std::shared_ptr<ReplyThread> reply_;
  const Duration stalled_reader_limit_;
  std::atomic<std::uint64_t> published_{1};
  std::atomic<std::uint64_t> batches_{0};
  std::vector<std::unique_ptr<Group>> groups_;
  TimePoint next_stall_check_{};
};

}  // namespace axisd::server
