// The yardstick of rpc_bench.py: a server on gRPC's callback API that sends what axisd sent once, and does
// nothing else.
//   bench_bare_server LISTEN FILE      FILE: an answer of ListAxes (bench_rpc_client fetch)
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <set>
#include <thread>

#include "axisd/v1/axis_service.grpc.pb.h"

namespace {

namespace v1 = axisd::v1;

class Stream;

/// Streams that are open. Thread: any.
class Streams {
 public:
  void add(Stream& stream) {
    const std::lock_guard lock(mutex_);
    all_.insert(&stream);
  }
  void remove(Stream& stream) {
    const std::lock_guard lock(mutex_);
    all_.erase(&stream);
  }
  void tick(const v1::WatchAxesResponse& batch);

 private:
  std::mutex mutex_;
  std::set<Stream*> all_;
};

/// Writes a batch each tick, unless the last one is still under way.
class Stream final : public grpc::ServerWriteReactor<v1::WatchAxesResponse> {
 public:
  explicit Stream(Streams& streams) : streams_(streams) { streams_.add(*this); }
  void send(const v1::WatchAxesResponse& batch) {
    if (!busy_.exchange(true)) StartWrite(&batch);
  }
  void OnWriteDone(bool) override { busy_ = false; }
  void OnCancel() override {
    streams_.remove(*this);
    Finish(grpc::Status::CANCELLED);
  }
  void OnDone() override { delete this; }

 private:
  Streams& streams_;
  std::atomic<bool> busy_ = false;
};

void Streams::tick(const v1::WatchAxesResponse& batch) {
  const std::lock_guard lock(mutex_);
  for (auto* stream : all_) stream->send(batch);
}

class Service final : public v1::AxisService::CallbackService {
 public:
  explicit Service(v1::ListAxesResponse states) : states_(std::move(states)) {
    *state_.mutable_state() = states_.axes(0);
  }
  grpc::ServerUnaryReactor* ListAxes(grpc::CallbackServerContext* context, const v1::ListAxesRequest*,
                                     v1::ListAxesResponse* response) override {
    *response = states_;
    return finished(context);
  }
  grpc::ServerUnaryReactor* GetAxis(grpc::CallbackServerContext* context, const v1::GetAxisRequest*,
                                    v1::GetAxisResponse* response) override {
    *response = state_;
    return finished(context);
  }
  grpc::ServerWriteReactor<v1::WatchAxesResponse>* WatchAxes(grpc::CallbackServerContext*,
                                                             const v1::WatchAxesRequest*) override {
    return new Stream(streams_);
  }

  /// A tick each 10 ms, for ever.
  void run() {
    v1::WatchAxesResponse batch;
    *batch.mutable_axes() = states_.axes();
    for (auto due = std::chrono::steady_clock::now();; due += std::chrono::milliseconds(10)) {
      std::this_thread::sleep_until(due);
      streams_.tick(batch);
    }
  }

 private:
  static grpc::ServerUnaryReactor* finished(grpc::CallbackServerContext* context) {
    auto* reactor = context->DefaultReactor();
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }

  v1::ListAxesResponse states_;
  v1::GetAxisResponse state_;
  Streams streams_;
};

}  // namespace

int main(int argc, char** argv) {
  v1::ListAxesResponse states;
  std::ifstream file(argc == 3 ? argv[2] : "", std::ios::binary);
  if (!states.ParseFromIstream(&file) || states.axes().empty()) {
    std::fputs("usage: bench_bare_server LISTEN FILE, with an answer of ListAxes\n", stderr);
    return 2;
  }
  Service service(std::move(states));
  grpc::ServerBuilder builder;
  builder.AddListeningPort(argv[1], grpc::InsecureServerCredentials());
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  if (!server) return 1;
  std::puts("ready");
  std::fflush(stdout);
  service.run();
}
