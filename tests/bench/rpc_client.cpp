// The client of the benchmarks, the same for axisd and for the bare server. Times are of the monotonic clock,
// in ns.
//   bench_rpc_client TARGET fetch FILE      writes the answer of ListAxes
//   bench_rpc_client TARGET get SECONDS     GetAxis, one after the other; prints how long each took
//   bench_rpc_client TARGET watch N SECONDS [PERIOD_MS]
//                                           N streams, a batch each 10 ms; prints when each came, by stream
//   bench_rpc_client TARGET stall N SECONDS the same, but after its first batch nobody reads
//   bench_rpc_client TARGET stop N          Stop at random moments, of the axes that are online in turn;
//   prints
//                                           when each was called, arrived and was answered, and for which
//                                           axis
//   bench_rpc_client TARGET stop-all -      StopAll for each line that comes on the standard input; prints
//                                           when each was called, arrived and was answered
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace {

using namespace std::chrono_literals;
namespace v1 = axisd::v1;
using Stub = v1::AxisService::Stub;

long long now() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

std::chrono::seconds seconds(const char* text) { return std::chrono::seconds(std::atoi(text)); }

void must(const grpc::Status& status, const char* what) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s: %s\n", what, status.error_message().c_str());
  std::exit(1);
}

v1::ListAxesResponse list(Stub& stub) {
  grpc::ClientContext context;
  v1::ListAxesResponse response;
  must(stub.ListAxes(&context, {}, &response), "ListAxes");
  return response;
}

void fetch(Stub& stub, const char* path) {
  std::ofstream file(path, std::ios::binary);
  list(stub).SerializeToOstream(&file);
}

void get(Stub& stub, std::chrono::seconds duration) {
  v1::GetAxisRequest request;
  request.set_axis(list(stub).axes(0).axis());
  std::vector<long long> took;
  for (const auto end = now() + std::chrono::nanoseconds(duration).count(); now() < end;) {
    grpc::ClientContext context;
    v1::GetAxisResponse response;
    const auto begin = now();
    must(stub.GetAxis(&context, request, &response), "GetAxis");
    took.push_back(now() - begin);
  }
  for (const auto each : took) std::printf("%lld\n", each);
}

/// One stream; `limit` batches are read, then none any more.
class Watcher final : public grpc::ClientReadReactor<v1::WatchAxesResponse> {
 public:
  Watcher(Stub& stub, int period_ms, std::size_t limit) : limit_(limit) {
    v1::WatchAxesRequest request;
    request.mutable_period()->set_nanos(period_ms * 1'000'000);
    stub.async()->WatchAxes(&context_, &request, this);
    StartRead(&batch_);
    AddHold();
    StartCall();
  }
  void OnReadDone(bool ok) override {
    if (!ok) return;
    came_.push_back(now());
    if (came_.size() < limit_) StartRead(&batch_);
  }
  void OnDone(const grpc::Status&) override { done_.store(true); }
  void end() {
    context_.TryCancel();
    RemoveHold();
    while (!done_.load()) std::this_thread::sleep_for(1ms);
  }
  [[nodiscard]] const std::vector<long long>& came() const { return came_; }

 private:
  grpc::ClientContext context_;
  v1::WatchAxesResponse batch_;
  std::vector<long long> came_;
  std::size_t limit_;
  std::atomic<bool> done_ = false;
};

void watch(Stub& stub, int streams, std::chrono::seconds duration, int period_ms, std::size_t limit) {
  std::vector<std::unique_ptr<Watcher>> watchers;
  watchers.reserve(static_cast<std::size_t>(streams));
  for (int i = 0; i < streams; ++i) watchers.push_back(std::make_unique<Watcher>(stub, period_ms, limit));
  std::this_thread::sleep_for(duration);
  for (const auto& watcher : watchers) watcher->end();
  for (std::size_t i = 0; i < watchers.size(); ++i)
    for (const auto at : watchers[i]->came()) std::printf("%zu %lld\n", i, at);
}

/// A time of the daemon, which runs on this computer.
long long monotonic(const google::protobuf::Timestamp& wall) {
  const auto ahead = std::chrono::system_clock::now().time_since_epoch() - std::chrono::nanoseconds(now());
  const auto at = std::chrono::seconds(wall.seconds()) + std::chrono::nanoseconds(wall.nanos());
  return std::chrono::nanoseconds(at - ahead).count();
}

void stop(Stub& stub, int count) {
  std::vector<std::string> axes;
  for (const auto& axis : list(stub).axes())
    if (axis.link() == v1::LINK_STATE_ONLINE) axes.push_back(axis.axis());
  std::mt19937 random(1);
  std::uniform_int_distribution<int> pause_us(20'000, 60'000);
  for (int i = 0; i < count; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(pause_us(random)));
    grpc::ClientContext context;
    v1::StopRequest request;
    v1::StopResponse response;
    request.set_axis(axes.at(static_cast<std::size_t>(i) % axes.size()));
    request.mutable_options()->set_request_id("bench-" + std::to_string(now()));
    const auto begin = now();
    must(stub.Stop(&context, request, &response), "Stop");
    std::printf("%lld %lld %lld %s\n", begin, monotonic(response.command().accepted_at()), now(),
                request.axis().c_str());
  }
}

void stop_all(v1::SystemService::Stub& stub) {
  for (int c = std::getchar(); c != EOF; c = std::getchar()) {
    if (c != '\n') continue;
    grpc::ClientContext context;
    v1::StopAllResponse response;
    const auto begin = now();
    must(stub.StopAll(&context, {}, &response), "StopAll");
    std::printf("%lld %lld %lld\n", begin, monotonic(response.results(0).command().accepted_at()), now());
    std::fflush(stdout);
  }
}

int usage() {
  std::fputs("usage: bench_rpc_client TARGET fetch FILE|get S|watch N S|stall N S|stop N|stop-all -\n",
             stderr);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return usage();
  const auto channel = grpc::CreateChannel(argv[1], grpc::InsecureChannelCredentials());
  const auto stub = v1::AxisService::NewStub(channel);
  const std::string_view command = argv[2];
  if (command == "fetch")
    fetch(*stub, argv[3]);
  else if (command == "get")
    get(*stub, seconds(argv[3]));
  else if (command == "watch" && (argc == 5 || argc == 6))
    watch(*stub, std::atoi(argv[3]), seconds(argv[4]), argc == 6 ? std::atoi(argv[5]) : 10, SIZE_MAX);
  else if (command == "stall" && argc == 5)
    watch(*stub, std::atoi(argv[3]), seconds(argv[4]), 10, 1);
  else if (command == "stop")
    stop(*stub, std::atoi(argv[3]));
  else if (command == "stop-all")
    stop_all(*v1::SystemService::NewStub(channel));
  else
    return usage();
  return 0;
}
