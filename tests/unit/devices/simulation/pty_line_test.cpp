// The line behind a real pseudo terminal. Waits have generous ends and no test asserts a measured time.
#include "devices/simulation/pty_line.hpp"

#include <asm/termbits.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>

#include "devices/simulation/control.hpp"
#include "devices/simulation/control_socket.hpp"
#include "devices/simulation/crc.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd::simulation {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;
using ::testing::StartsWith;

constexpr int patience_ms = 20'000;

/// What opens the terminal.
class Client {
 public:
  explicit Client(const std::string& path) : fd_(open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK)) {}
  ~Client() { close(fd_); }
  Client(const Client&) = delete;
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }

  /// What a daemon sets; any rate, also one without a constant of its own.
  void set(int baud, int stop_bits = 1) {
    termios2 settings{};
    ASSERT_EQ(0, ioctl(fd_, TCGETS2, &settings));
    settings.c_cflag = BOTHER | CS8 | CREAD | (stop_bits == 2 ? CSTOPB : 0U);
    settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(baud);
    ASSERT_EQ(0, ioctl(fd_, TCSETS2, &settings));
  }

  void send(Bytes request) {
    append_frame_crc(request);
    ASSERT_EQ(static_cast<ssize_t>(request.size()), write(fd_, request.data(), request.size()));
  }
  /// `size` bytes, fewer if they do not come or the line hangs up.
  Bytes receive(std::size_t size) {
    Bytes bytes;
    while (bytes.size() < size) {
      pollfd waited{fd_, POLLIN, 0};
      if (poll(&waited, 1, patience_ms) != 1) break;
      std::uint8_t byte = 0;
      if (read(fd_, &byte, 1) != 1) break;
      bytes.push_back(byte);
    }
    return bytes;
  }
  Bytes ask(Bytes request, std::size_t reply_size) {
    send(std::move(request));
    return receive(reply_size);
  }
  bool sees_hang_up() {
    pollfd waited{fd_, 0, 0};
    return poll(&waited, 1, patience_ms) == 1 && (waited.revents & POLLHUP) != 0;
  }

 private:
  int fd_;
};

class PtyLineTest : public ::testing::Test {
 protected:
  PtyLineTest() {
    char pattern[] = "/tmp/axisd-pty-XXXXXX";
    folder = mkdtemp(pattern);
    std::vector<std::unique_ptr<SimulatedRtuNode>> nodes;
    nodes.push_back(*make_node("ykd2405pr", SimulatedNodeSettings{}));
    auto opened =
        PtyLine::open({.serial = {},
                       .link = folder + "/line",
                       .observer = [this](TimePoint, bool received,
                                          std::span<const std::uint8_t>) { (received ? rx : tx)++; }},
                      std::move(nodes));
    if (opened) line = std::move(*opened);
  }
  ~PtyLineTest() override {
    line.reset();
    EXPECT_NE(0, access((folder + "/line").c_str(), F_OK)) << "the link is gone";
    EXPECT_EQ(0, rmdir(folder.c_str()));
  }
  std::string command(std::string_view text) { return execute_control(*line, text); }

  std::string folder;
  std::atomic<int> rx = 0, tx = 0;
  std::unique_ptr<PtyLine> line;
};

const Bytes read_speed{1, 3, 0, 0x23, 0, 1};

TEST_F(PtyLineTest, AnswersAndLogsEachFrame) {
  ASSERT_TRUE(line);
  Client client(line->path());
  for (int i = 1; i <= 3; ++i) {
    EXPECT_EQ((Bytes{1, 3, 2, 0, 0x3C, 0xB8, 0x55}), client.ask(read_speed, 7));
    EXPECT_EQ(i, rx);
    EXPECT_EQ(i, tx);
  }
}

TEST_F(PtyLineTest, OutlivesItsClients) {
  for (int i = 0; i < 3; ++i) {
    Client client(line->path());
    ASSERT_TRUE(client.is_open());
    EXPECT_EQ(7U, client.ask(read_speed, 7).size());
  }
}

TEST_F(PtyLineTest, HangsUpAndComesBack) {
  {
    Client client(line->path());
    EXPECT_EQ(7U, client.ask(read_speed, 7).size());
    EXPECT_EQ("ok", command("hangup"));
    EXPECT_TRUE(client.sees_hang_up());
    EXPECT_FALSE(Client(line->path()).is_open());
    EXPECT_FALSE(line->plugged());
  }
  EXPECT_THAT(command("replug"), StartsWith("ok " + folder));
  Client client(line->path());
  EXPECT_EQ(7U, client.ask(read_speed, 7).size());
}

TEST_F(PtyLineTest, AHangUpFaultPullsTheAdapterOut) {
  Client client(line->path());
  EXPECT_EQ("ok", command("fault hang_up"));
  client.send(read_speed);
  EXPECT_TRUE(client.sees_hang_up());
}

TEST_F(PtyLineTest, ACutCableAnswersNothingUntilItIsJoined) {
  Client client(line->path());
  EXPECT_EQ("ok", command("cut"));
  client.send(read_speed);
  while (rx == 0) line->with_network([](RtuNetwork&) {});
  EXPECT_EQ("ok", command("join"));
  EXPECT_EQ(7U, client.ask(read_speed, 7).size());
  EXPECT_EQ(1, tx);
}

TEST_F(PtyLineTest, FollowsTheSettingsOfItsClient) {
  Client client(line->path());
  EXPECT_EQ(7U, client.ask(read_speed, 7).size()) << "it begins as the drives are set";
  int heard = rx;
  const auto not_heard = [&] {
    client.send(read_speed);
    while (rx == heard) line->with_network([](RtuNetwork&) {});
    heard = rx;
    return line->with_network([](RtuNetwork& network) { return network.serial(); });
  };
  client.set(14400);
  EXPECT_EQ(14400, not_heard()->baud);
  client.set(115200, 2);
  EXPECT_EQ(2, not_heard()->format.stop_bits);
  client.set(115200);
  EXPECT_EQ(7U, client.ask(read_speed, 7).size());
  EXPECT_EQ(2, tx) << "and nothing while the settings differed";
}

TEST_F(PtyLineTest, FindsADriveAtAnyCustomRate) {
  line->with_network([](RtuNetwork& network) {
    for (const std::uint16_t code : {1, 2, 3}) {
      SimulatedNodeSettings settings;
      settings.address = static_cast<std::uint8_t>(10 + code);
      settings.dip_baud = 0;
      settings.eeprom = {{0x0014, code}};
      network.add(*make_node("ssd2608pr", settings));
    }
  });
  Client client(line->path());
  std::uint8_t node = 11;
  for (const int baud : {14400, 128000, 256000}) {
    client.set(baud);
    EXPECT_EQ(node, client.ask({node, 3, 0, 0x23, 0, 1}, 7).at(0));
    ++node;
  }
}

TEST_F(PtyLineTest, TakesControlCommands) {
  EXPECT_EQ("ok position=0 moving=0 starts=0", command("shaft 1"));
  EXPECT_EQ("ok 60", command("peek 1 0x0023"));
  EXPECT_EQ("ok", command("poke 1 0x23 90"));
  EXPECT_EQ("ok 90", command("peek 1 0x23"));
  EXPECT_EQ("ok", command("input 1 X3 on"));
  EXPECT_EQ("ok", command("input 1 X3 auto"));
  EXPECT_EQ("ok", command("alarm 1 1"));
  EXPECT_EQ("ok 1", command("peek 1 6"));
  EXPECT_EQ("ok", command("power 1 off"));
  EXPECT_EQ("ok", command("power 1 on"));
  EXPECT_EQ("ok 0", command("peek 1 6"));
  EXPECT_EQ("ok 0", command("eeprom 1"));
  EXPECT_EQ("ok", command("fault drop_reply count=1 register=0x0027"));
  EXPECT_EQ("ok", command("fault clear"));
  EXPECT_THAT(command("help"), StartsWith("ok power"));
}

TEST_F(PtyLineTest, RefusesCommandsThatItDoesNotUnderstand) {
  for (const auto* wrong :
       {"",           "nonsense",      "nonsense 1",    "power",           "power 1",   "power 1 maybe",
        "power 9 on", "input 1 X9 on", "input 1 X3",    "input 1 X3 high", "alarm 1 6", "alarm 1 x",
        "peek 1",     "peek 1 x",      "poke 1 2",      "poke 1 2 99999",  "shaft",     "shaft 1 2",
        "eeprom 1 2", "fault",         "fault nonsense"})
    EXPECT_THAT(command(wrong), StartsWith("error ")) << wrong;
}

TEST_F(PtyLineTest, ControlSocketAnswersLineByLine) {
  const auto path = folder + "/control";
  auto control = ControlSocket::open(path, [this](std::string_view text) { return command(text); });
  ASSERT_TRUE(control);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  path.copy(address.sun_path, path.size());
  const int client = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(0, connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof(address)));
  const std::string commands = "peek 1 0x23\nnonsense\n";
  ASSERT_EQ(static_cast<ssize_t>(commands.size()), send(client, commands.data(), commands.size(), 0));
  std::string replies;
  while (std::ranges::count(replies, '\n') < 2) {
    char byte = 0;
    ASSERT_EQ(1, recv(client, &byte, 1, 0));
    replies += byte;
  }
  EXPECT_THAT(replies, StartsWith("ok 60\nerror "));
  close(client);
  control->reset();
  EXPECT_NE(0, access(path.c_str(), F_OK));
}

TEST_F(PtyLineTest, ControlSocketMayHaveANameWithoutAFile) {
  const auto name = fmt::format("@axisd-test-{}", getpid());
  const auto answer = [](std::string_view text) { return "ok " + std::string(text); };
  auto control = ControlSocket::open(name, answer);
  ASSERT_TRUE(control);
  EXPECT_FALSE(ControlSocket::open(name, answer)) << "it is taken";
  EXPECT_NE(0, access(name.c_str(), F_OK));
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  name.copy(address.sun_path, name.size());
  address.sun_path[0] = '\0';
  const int client = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(0, connect(client, reinterpret_cast<const sockaddr*>(&address),
                       static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size())));
  ASSERT_EQ(3, send(client, "hi\n", 3, 0));
  std::array<char, 6> reply{};
  ASSERT_EQ(6, recv(client, reply.data(), reply.size(), MSG_WAITALL));
  EXPECT_EQ(std::string(reply.data(), reply.size()), "ok hi\n");
  close(client);
}

TEST_F(PtyLineTest, ControlSocketLetsSoManyInAndTheNextWhenOneLeaves) {
  const auto path = folder + "/control";
  auto control = ControlSocket::open(path, [](std::string_view text) { return "ok " + std::string(text); });
  ASSERT_TRUE(control);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  path.copy(address.sun_path, path.size());
  const auto connected = [&] {
    const int client = socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(0, connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof(address)));
    return client;
  };
  const auto expect_answer = [](int client) {
    std::array<char, 6> reply{};
    EXPECT_EQ(6, recv(client, reply.data(), reply.size(), MSG_WAITALL));
  };
  const auto ask = [](int client) { EXPECT_EQ(3, send(client, "hi\n", 3, 0)); };
  std::array<int, 16> clients{};
  for (int& client : clients) {
    client = connected();
    ask(client);
    expect_answer(client);
  }
  const int next = connected();
  ask(next);
  for (int round = 0; round < 3; ++round) {  // each is a look at all sockets
    ask(clients[1]);
    expect_answer(clients[1]);
  }
  pollfd answered{next, POLLIN, 0};
  EXPECT_EQ(0, poll(&answered, 1, 0));
  close(clients[0]);
  expect_answer(next);
  close(next);
  for (std::size_t i = 1; i < clients.size(); ++i) close(clients[i]);
}

TEST_F(PtyLineTest, PathsThatAreTakenAreRefusedAndLeftAlone) {
  const auto taken = folder + "/taken";
  ASSERT_EQ(0, mkdir(taken.c_str(), 0700));
  EXPECT_FALSE(PtyLine::open({.serial = {}, .link = taken, .observer = {}}, {}));
  EXPECT_FALSE(PtyLine::open({.serial = {}, .link = folder + "/no/such", .observer = {}}, {}));
  EXPECT_FALSE(ControlSocket::open(taken, [](std::string_view) { return std::string(); }));
  EXPECT_EQ(0, rmdir(taken.c_str()));
}

}  // namespace
}  // namespace axisd::simulation
