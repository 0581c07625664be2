// Axes of a server without TLS index: each moves to and fro, and asks for its next move as soon as the last
// one is done. One connection, one call at a time for each axis; what is refused or expires is asked for
// again 20 ms later. bench_command_client has made the axes ready.
//   bench_index_client TARGET COUNT HERE THERE S   the first COUNT axes, for S seconds; prints, a line each:
//     moves DONE EXPIRED REFUSED OTHERWISE
//     call MEDIAN P99 MAXIMUM                      of a move that was done, ms
//     start MEDIAN P99 MAXIMUM                     from its acceptance until the drive was told to start, ms
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "axisd/v1/axis_service.grpc.pb.h"

namespace {

using namespace std::chrono_literals;
namespace v1 = axisd::v1;
using Stub = v1::AxisService::Stub;
using Clock = std::chrono::steady_clock;

constexpr auto pause = 20ms;
constexpr int ramp_ns = 10'000'000;  // short: the drive shall not be what is waited for

double in_ms(const google::protobuf::Timestamp& time) {
  return static_cast<double>(time.seconds()) * 1e3 + static_cast<double>(time.nanos()) / 1e6;
}

void print(const char* what, std::vector<double> times) {
  std::ranges::sort(times);
  const auto at = [&](double share) {
    return times.empty() ? 0.0
                         : times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  std::printf("%s %.2f %.2f %.2f\n", what, at(0.5), at(0.99), at(1));
}

/// What became of all moves.
class Count {
 public:
  /// False: it is to be asked for again.
  bool add(const grpc::Status& status, const v1::Command& command, Clock::duration took) {
    const std::lock_guard lock(mutex_);
    if (status.ok() && command.state() == v1::COMMAND_STATE_DONE) {
      ++done_;
      calls_.push_back(std::chrono::duration<double, std::milli>(took).count());
      starts_.push_back(in_ms(command.started_at()) - in_ms(command.accepted_at()));
      return true;
    }
    const bool expired = status.ok() && command.cause().reason() == v1::REASON_EXPIRED;
    auto& kind = expired ? expired_ : status.ok() ? otherwise_ : refused_;
    if (kind++ == 0)
      std::fprintf(stderr, "the first of its kind: %s %s\n", status.error_message().c_str(),
                   command.ShortDebugString().c_str());
    return false;
  }
  void print_all() {
    const std::lock_guard lock(mutex_);
    std::printf("moves %ld %ld %ld %ld\n", done_, expired_, refused_, otherwise_);
    print("call", calls_);
    print("start", starts_);
  }

 private:
  std::mutex mutex_;
  long done_ = 0, expired_ = 0, refused_ = 0, otherwise_ = 0;
  std::vector<double> calls_, starts_;
};

class Indexing {
 public:
  struct Way {
    double here = 0, there = 0;
  };
  Indexing(Stub& stub, Count& count, std::string axis, Way way, Clock::time_point end)
      : stub_(&stub), count_(&count), axis_(std::move(axis)), way_(way), end_(end) {}

  void begin() {
    if (Clock::now() >= end_) {
      ended_ = true;
      return;
    }
    static const auto run = std::to_string(Clock::now().time_since_epoch().count());
    request_.Clear();
    response_.Clear();
    request_.set_axis(axis_);
    request_.set_position(away_ ? way_.here : way_.there);
    request_.mutable_acceleration_time()->set_nanos(ramp_ns);
    request_.mutable_options()->set_request_id(run + axis_ + "-" + std::to_string(++number_));
    request_.mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
    context_ = std::make_unique<grpc::ClientContext>();
    begun_ = Clock::now();
    stub_->async()->MoveAbsolute(context_.get(), &request_, &response_,
                                 [this](const grpc::Status& status) { on_end(status); });
  }
  [[nodiscard]] bool ended() const { return ended_; }
  /// Asks again, if that is due.
  void look() {
    if (!refused_ || Clock::now() < again_) return;
    refused_ = false;
    begin();
  }

 private:
  void on_end(const grpc::Status& status) {
    if (count_->add(status, response_.command(), Clock::now() - begun_)) {
      away_ = !away_;
      return begin();
    }
    again_ = Clock::now() + pause;
    refused_ = true;
  }

  Stub* stub_;
  Count* count_;
  std::string axis_;
  Way way_;
  Clock::time_point end_, begun_, again_;
  v1::MoveAbsoluteRequest request_;
  v1::MoveAbsoluteResponse response_;
  std::unique_ptr<grpc::ClientContext> context_;
  bool away_ = false;
  long number_ = 0;
  std::atomic<bool> refused_ = false, ended_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fputs("usage: bench_index_client TARGET COUNT HERE THERE S\n", stderr);
    return 2;
  }
  const auto stub =
      v1::AxisService::NewStub(grpc::CreateChannel(argv[1], grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  v1::ListAxesResponse listed;
  if (const auto status = stub->ListAxes(&context, {}, &listed); !status.ok()) {
    std::fprintf(stderr, "ListAxes: %s\n", status.error_message().c_str());
    return 1;
  }
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(std::strtod(argv[5], nullptr)));
  const Indexing::Way way{.here = std::strtod(argv[3], nullptr), .there = std::strtod(argv[4], nullptr)};
  Count count;
  std::vector<std::unique_ptr<Indexing>> all;
  for (const auto& axis : listed.axes())
    if (all.size() < std::strtoul(argv[2], nullptr, 10))
      all.push_back(std::make_unique<Indexing>(*stub, count, axis.axis(), way, end));
  for (auto& axis : all) axis->begin();
  while (!std::ranges::all_of(all, [](const auto& axis) { return axis->ended(); })) {
    std::this_thread::sleep_for(5ms);
    for (auto& axis : all) axis->look();
  }
  count.print_all();
  return 0;
}
