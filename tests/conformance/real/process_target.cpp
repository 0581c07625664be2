#include "tests/conformance/real/process_target.hpp"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "tests/conformance/real/process.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

/// For a program to come up or to end, on a loaded computer.
constexpr Duration patience = 30s;

/// The plant's network is simulated in the daemon; here it is an interface. System calls take long in a
/// guest, and most are about SYNC: a plant that does not care how often that is has fewer of them.
std::string adapted(std::string yaml, const std::string& interface) {
  const auto replace = [&](std::string_view text, const std::string& by) {
    const auto at = yaml.find(text);
    if (at != std::string::npos) yaml.replace(at, text.size(), by);
    return at != std::string::npos;
  };
  if (!replace("interface: sim", "interface: " + interface))
    throw std::invalid_argument("no network in\n" + yaml);
  replace("sync_period: 10 ms", "sync_period: 50 ms");
  return yaml;
}

/// A vcan has no bit rate: the simulator is told which it would have.
std::string bitrate_of(const std::string& yaml) {
  constexpr std::string_view key = "bitrate: ";
  const auto at = yaml.find(key);
  if (at == std::string::npos) throw std::invalid_argument("no bit rate in\n" + yaml);
  const auto begin = at + key.size();
  return yaml.substr(begin, yaml.find_first_not_of("0123456789", begin) - begin);
}

/// One line to a unix socket, and its answer.
std::string exchange(const std::string& path, std::string_view line) {
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) throw std::system_error(errno, std::generic_category(), "socket");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  std::string answer = "error the simulator does not answer";
  const auto request = std::string(line) + "\n";
  if (connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      write(socket, request.data(), request.size()) == static_cast<ssize_t>(request.size())) {
    std::string received;
    char byte = 0;
    while (read(socket, &byte, 1) == 1 && byte != '\n') received.push_back(byte);
    if (byte == '\n') answer = received;
  }
  close(socket);
  return answer;
}

class ProcessTarget final : public Target {
 public:
  ProcessTarget(const Programs& programs, const std::string& interface, const Plant& plant)
      : axisd_(programs.axisd) {
    directory_.write("axisd.yaml", adapted(plant.yaml, interface));
    std::vector<std::string> arguments{
        programs.axisd_sim,    "--can", interface, "--control", directory_ / "sim.sock", "--bitrate",
        bitrate_of(plant.yaml)};
    for (const auto& drive : plant.drives) arguments.insert(arguments.end(), {"--drive", drive});
    simulator_ = std::make_unique<Process>(arguments, directory_ / "sim.log");
    if (!wait_until([&] { return simulator_->output().find("ready") != std::string::npos; }, patience))
      throw std::runtime_error("axisd-sim is not ready: " + simulator_->output());
    start();
  }

  std::shared_ptr<grpc::Channel> channel() override { return channel_; }
  std::string control(std::string_view line) override { return exchange(directory_ / "sim.sock", line); }
  void pass(Duration duration) override { block_until(monotonic_now() + duration); }
  void restart() override {
    channel_.reset();
    const auto status = daemon_->end(patience);
    if (status != 0) throw std::runtime_error("axisd did not end in order: " + daemon_->output());
    start();
  }

 private:
  void start();

  std::string axisd_;
  test::TemporaryDirectory directory_;
  std::unique_ptr<Process> simulator_;
  std::unique_ptr<Process> daemon_;  // ends first
  int starts_ = 0;
  std::shared_ptr<grpc::Channel> channel_;
};

void ProcessTarget::start() {
  const auto address = "unix:" + (directory_ / fmt::format("{}.sock", ++starts_));
  const auto log = directory_ / fmt::format("axisd-{}.log", starts_);
  daemon_ = std::make_unique<Process>(
      std::vector<std::string>{axisd_, "--config", directory_ / "axisd.yaml", "--state-directory",
                               directory_ / "state", "--listen", address, "--log-level", "warn"},
      log);
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
  channel_ = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  const auto connected = [&] {
    return daemon_->status().has_value() ||
           channel_->WaitForConnected(std::chrono::system_clock::now() + std::chrono::milliseconds(20));
  };
  if (!wait_until(connected, patience))
    throw std::runtime_error("axisd serves nothing: " + daemon_->output());
  if (daemon_->status() == 2) throw std::invalid_argument(daemon_->output());
  if (const auto status = daemon_->status())
    throw std::runtime_error(fmt::format("axisd has ended (status {}): {}", *status, daemon_->output()));
}

}  // namespace

std::unique_ptr<Target> make_process_target(const Programs& programs, const std::string& interface,
                                            const Plant& plant) {
  return std::make_unique<ProcessTarget>(programs, interface, plant);
}

}  // namespace axisd::conformance
