// Commands as fast as they are taken, and in step; of a server without TLS.
//   bench_command_client TARGET ready              enables every axis, and declares its position 0
//   bench_command_client TARGET noop CLIENTS S     moves to where the axes stand: each client has a
//   connection and as
//                                                  many axes as are its share, and asks one after the other;
//                                                  prints how many ended as done, how many otherwise and were
//                                                  refused, and the time of a call in us, median and 99 %
//   bench_command_client TARGET index PERIOD_MS S  every axis moves by 1 to and fro, once in each period;
//   prints how
//                                                  many moves were done, how many not, how many had not ended
//                                                  when the next one was due, and their time in ms, median
//                                                  and 99 %
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "axisd/v1/axis_service.grpc.pb.h"

namespace {

using namespace std::chrono_literals;
namespace v1 = axisd::v1;
using Stub = v1::AxisService::Stub;
using Clock = std::chrono::steady_clock;

std::unique_ptr<Stub> connect(const char* target) {
  grpc::ChannelArguments arguments;
  arguments.SetInt("grpc.use_local_subchannel_pool", 1);  // a connection of its own
  return v1::AxisService::NewStub(
      grpc::CreateCustomChannel(target, grpc::InsecureChannelCredentials(), arguments));
}

void must(const grpc::Status& status, const char* what) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s: %s\n", what, status.error_message().c_str());
  std::exit(1);
}

std::string fresh_id() {
  static const auto run = std::to_string(Clock::now().time_since_epoch().count());
  static std::atomic<int> last = 0;
  return run + "-" + std::to_string(++last);
}

template <class Request>
Request request_of(const std::string& axis) {
  Request request;
  request.set_axis(axis);
  request.mutable_options()->set_request_id(fresh_id());
  request.mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
  return request;
}

std::vector<std::string> axes_of(Stub& stub) {
  grpc::ClientContext context;
  v1::ListAxesResponse response;
  must(stub.ListAxes(&context, {}, &response), "ListAxes");
  std::vector<std::string> axes;
  for (const auto& axis : response.axes()) axes.push_back(axis.axis());
  return axes;
}

/// In us or ms: median and 99 %.
void print_times(std::vector<double> times) {
  std::ranges::sort(times);
  const auto at = [&](double share) {
    return times.empty() ? 0.0
                         : times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  std::printf(" %.1f %.1f\n", at(0.5), at(0.99));
}

void ready(const char* target) {
  const auto stub = connect(target);
  for (const auto& axis : axes_of(*stub)) {
    grpc::ClientContext context;
    v1::EnableResponse enabled;
    must(stub->Enable(&context, request_of<v1::EnableRequest>(axis), &enabled), "Enable");
    grpc::ClientContext again;
    v1::SetPositionResponse set;
    auto position = request_of<v1::SetPositionRequest>(axis);
    position.set_position(0);
    must(stub->SetPosition(&again, position, &set), "SetPosition");
  }
}

struct Count {
  std::mutex mutex;
  long done = 0, otherwise = 0, late = 0;
  std::vector<double> times;
  void add(const grpc::Status& status, const v1::Command& command, Clock::duration took, double unit) {
    const std::lock_guard lock(mutex);
    const bool was_done = status.ok() && command.state() == v1::COMMAND_STATE_DONE;
    if (!was_done && otherwise == 0)
      std::fprintf(stderr, "the first that was not done: %s %s\n", status.error_message().c_str(),
                   command.ShortDebugString().c_str());
    ++(was_done ? done : otherwise);
    times.push_back(std::chrono::duration<double>(took).count() * unit);
  }
};

void noop(const char* target, std::size_t clients, std::chrono::seconds duration) {
  const auto axes = axes_of(*connect(target));
  Count count;
  const auto end = Clock::now() + duration;
  std::vector<std::thread> threads;
  threads.reserve(clients);
  for (std::size_t client = 0; client < clients; ++client)
    threads.emplace_back([&, client] {
      const auto stub = connect(target);
      for (auto at = client; Clock::now() < end; at = at + clients < axes.size() ? at + clients : client) {
        auto request = request_of<v1::MoveAbsoluteRequest>(axes[at % axes.size()]);
        request.set_position(0);
        grpc::ClientContext context;
        v1::MoveAbsoluteResponse response;
        const auto begin = Clock::now();
        const auto status = stub->MoveAbsolute(&context, request, &response);
        count.add(status, response.command(), Clock::now() - begin, 1e6);
      }
    });
  for (auto& thread : threads) thread.join();
  std::printf("%ld %ld", count.done, count.otherwise);
  print_times(std::move(count.times));
}

/// The axis moves to and fro.
struct Indexing {
  std::string axis;
  v1::MoveAbsoluteRequest request;
  v1::MoveAbsoluteResponse response;
  std::unique_ptr<grpc::ClientContext> context;
  std::atomic<bool> under_way = false;
  bool away = false;
};

void index(const char* target, std::chrono::milliseconds period, std::chrono::seconds duration) {
  const auto stub = connect(target);
  std::vector<std::unique_ptr<Indexing>> all;
  for (const auto& axis : axes_of(*stub)) {
    all.push_back(std::make_unique<Indexing>());
    all.back()->axis = axis;
  }
  Count count;
  const auto begin = Clock::now();
  const auto step = std::chrono::nanoseconds(period) / all.size();
  for (auto due = begin; due < begin + duration;) {
    for (const auto& each : all) {
      due += step;
      std::this_thread::sleep_until(due);
      auto& axis = *each;
      if (axis.under_way.load()) {
        const std::lock_guard lock(count.mutex);
        ++count.late;
        continue;
      }
      axis.under_way.store(true);
      axis.away = !axis.away;
      axis.request = request_of<v1::MoveAbsoluteRequest>(axis.axis);
      axis.request.set_position(axis.away ? 1 : 0);
      axis.context = std::make_unique<grpc::ClientContext>();
      const auto called = Clock::now();
      stub->async()->MoveAbsolute(axis.context.get(), &axis.request, &axis.response,
                                  [&axis, &count, called](const grpc::Status& status) {
                                    count.add(status, axis.response.command(), Clock::now() - called, 1e3);
                                    axis.under_way.store(false);
                                  });
    }
  }
  for (const auto& axis : all)
    while (axis->under_way.load()) std::this_thread::sleep_for(1ms);
  std::printf("%ld %ld %ld", count.done, count.otherwise, count.late);
  print_times(std::move(count.times));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view command = argc > 2 ? argv[2] : "";
  if (command == "ready") {
    ready(argv[1]);
  } else if (command == "noop" && argc == 5) {
    noop(argv[1], std::strtoul(argv[3], nullptr, 10), std::chrono::seconds(std::atoi(argv[4])));
  } else if (command == "index" && argc == 5) {
    index(argv[1], std::chrono::milliseconds(std::atoi(argv[3])), std::chrono::seconds(std::atoi(argv[4])));
  } else {
    std::fputs("usage: bench_command_client TARGET ready|noop CLIENTS S|index PERIOD_MS S\n", stderr);
    return 2;
  }
  return 0;
}
