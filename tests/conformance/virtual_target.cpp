// A whole machine in one process and in virtual time, behind a real gRPC server.
#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <future>
#include <stdexcept>
#include <thread>

#include "api/server/server.hpp"
#include "config/configuration.hpp"
#include "daemon/core/machine_core.hpp"
#include "daemon/core/machine_service.hpp"
#include "tests/conformance/counted_machine.hpp"
#include "tests/conformance/target.hpp"
#include "tests/conformance/virtual_wire.hpp"
#include "tests/support/fake_journal.hpp"
#include "tests/support/fake_persistence.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

/// Longest that a call may make time pass. A call that never ends is a finding, and its client has a
/// deadline.
constexpr Duration longest_call = std::chrono::hours(2);
constexpr Duration daemon_end = 30s;

config::Configuration load(const std::string& yaml) {
  auto loaded = config::load_text(yaml, "conformance.yaml");
  if (loaded.configuration) return std::move(*loaded.configuration);
  std::string findings;
  for (const auto& finding : loaded.diagnostics) findings += to_string(finding) + "\n";
  throw std::invalid_argument(findings + yaml);
}

/// The daemon's core, as long as it runs. Thread: core.
struct Daemon {
  std::unique_ptr<core::MachineCore> machine;
  std::unique_ptr<core::MachineService> service;
  std::unique_ptr<Machine> counted;
};

class VirtualTarget final : public Target {
 public:
  explicit VirtualTarget(const Plant& plant)
      : configuration_(load(plant.yaml)), wire_(make_virtual_wire(world_, configuration_, plant)) {
    thread_ = std::thread([this] { run(); });
    try {
      start();
    } catch (...) {
      end_thread();
      throw;
    }
  }
  ~VirtualTarget() override {
    stop();
    end_thread();
  }
  VirtualTarget(const VirtualTarget&) = delete;
  VirtualTarget& operator=(const VirtualTarget&) = delete;

  std::shared_ptr<grpc::Channel> channel() override { return channel_; }
  std::string control(std::string_view line) override {
    std::string answer;
    on_core([&] { answer = wire_->control(line); });
    return answer;
  }
  void pass(Duration duration) override {
    pass_until([] { return false; }, duration);
  }
  void restart() override {
    stop();
    start();
  }

 private:
  void run();
  /// Runs `function` on the core thread, and waits for it.
  void on_core(std::function<void()> function) {
    std::promise<void> done;
    post(world_.executor(), [&] {
      try {
        function();
        done.set_value();
      } catch (...) {
        done.set_exception(std::current_exception());
      }
    });
    done.get_future().get();
  }
  void end_thread() {
    on_core([this] { ending_ = true; });
    thread_.join();
  }
  /// Lets time pass until `condition`, at most `limit`.
  void pass_until(std::function<bool()> condition, Duration limit) {
    std::promise<void> done;
    post(world_.executor(), [&] {
      passing_ = Passing{.end = world_.now() + limit, .condition = std::move(condition), .done = &done};
    });
    done.get_future().get();
  }
  [[nodiscard]] TimePoint time_may_pass_until();
  void start();
  void stop();

  struct Passing {
    TimePoint end;
    std::function<bool()> condition;
    std::promise<void>* done;
  };

  test::VirtualWorld world_;  // first: what follows uses it
  config::Configuration configuration_;
  std::unique_ptr<VirtualWire> wire_;
  test::TemporaryDirectory directory_;
  test::FakePersistence store_{world_.executor()};
  test::FakeJournal journal_{world_.executor()};
  CallLedger ledger_{world_.executor()};
  Daemon daemon_;
  int starts_ = 0;
  // Thread: core.
  std::optional<Passing> passing_;
  std::optional<TimePoint> call_since_;
  bool ending_ = false;

  std::unique_ptr<server::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::thread thread_;
};

/// The core thread: all that can happen now, then the answers, then the next moment, if there may be one.
void VirtualTarget::run() {
  auto& loop = world_.loop();
  while (!ending_) {
    while (loop.step()) {
    }
    if (ledger_.flush()) continue;
    if (passing_ && (world_.now() >= passing_->end || passing_->condition())) {
      auto* done = passing_->done;
      passing_.reset();
      done->set_value();
      continue;
    }
    const auto end = time_may_pass_until();
    const auto next = std::min(world_.clock().next(), passing_ ? passing_->end : TimePoint::max());
    if (next != TimePoint::max() && next <= end) {
      world_.clock().advance_to(next);
    } else {
      if (!ending_) loop.step(true);
    }
  }
}

TimePoint VirtualTarget::time_may_pass_until() {
  if (!ledger_.call_waits()) {
    call_since_.reset();
    return passing_ ? passing_->end : TimePoint::min();
  }
  if (!call_since_) call_since_ = world_.now();
  return *call_since_ + longest_call;
}

void VirtualTarget::start() {
  on_core([this] {
    store_.restart();
    journal_.restart(world_.clock().wall(world_.now()));
    const auto instance = fmt::format("c{}", ++starts_);
    core::MachineParts parts{.executor = world_.executor(),
                             .clock = &world_.clock(),
                             .persistence = &store_,
                             .journal = &journal_,
                             .instance_id = instance,
                             .published = [this] {
                               if (daemon_.service) daemon_.service->published();
                             }};
    wire_->connect(parts);
    daemon_.machine = std::make_unique<core::MachineCore>(std::move(parts), configuration_);
    daemon_.service = std::make_unique<core::MachineService>(world_.loop(), *daemon_.machine,
                                                             configuration_.machine, instance);
    daemon_.counted = count_calls(*daemon_.service, ledger_);
    wire_->attach_drives();
  });
  const auto address = "unix:" + (directory_ / fmt::format("{}.sock", starts_));
  server_ = std::make_unique<server::Server>(*daemon_.counted, server::ServerOptions{.listen = {address}});
  on_core([this] { daemon_.machine->start(); });
  if (const auto started = server_->start(); !started) throw std::runtime_error(to_string(started.error()));
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  channel_ = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

/// As the daemon ends: what moves is stopped, then the sequences end.
void VirtualTarget::stop() {
  if (!daemon_.machine) return;
  channel_.reset();
  on_core([this] {
    daemon_.service->close();
    daemon_.machine->stop_moving_axes();
  });
  pass_until([this] { return daemon_.machine->at_rest(); }, daemon_end);
  server_.reset();
  on_core([this] { daemon_.machine->close(); });
  pass_until([this] { return daemon_.machine->closed(); }, daemon_end);
  pass(100ms);  // what the line still had to deliver
  on_core([this] {
    if (!daemon_.machine->closed()) std::terminate();  // sequences that are left would use what is gone
    wire_->detach();
    daemon_ = {};
  });
}

}  // namespace

std::unique_ptr<Target> make_virtual_target(const Plant& plant) {
  return std::make_unique<VirtualTarget>(plant);
}

}  // namespace axisd::conformance
