// HTTP/2 of the stop lane against a client that is right, and against bytes that are not.
#include <gmock/gmock.h>
#include <nghttp2/nghttp2.h>

#include <random>

#include "api/server/lane/http2.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using server::lane::Http2;
using ::testing::HasSubstr;

std::string framed(const std::string& message) {
  std::string bytes(5, '\0');
  bytes[3] = static_cast<char>(message.size() >> 8U);
  bytes[4] = static_cast<char>(message.size() & 0xFFU);
  return bytes + message;
}

/// One frame as it goes over the wire.
std::string frame(std::uint8_t type, std::uint8_t flags, std::uint32_t stream, const std::string& payload) {
  std::string bytes;
  for (const auto each : {payload.size() >> 16U, payload.size() >> 8U, payload.size()})
    bytes += static_cast<char>(each & 0xFFU);
  bytes += static_cast<char>(type);
  bytes += static_cast<char>(flags);
  for (const auto shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>((stream >> shift) & 0xFFU);
  return bytes + payload;
}

const std::string preface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

/// A client by nghttp2, which keeps what it was told.
class Client {
 public:
  Client() {
    nghttp2_session_callbacks* callbacks = nullptr;
    nghttp2_session_callbacks_new(&callbacks);
    nghttp2_session_callbacks_set_on_header_callback(
        callbacks,
        [](nghttp2_session*, const nghttp2_frame*, const std::uint8_t* name, std::size_t name_length,
           const std::uint8_t* value, std::size_t value_length, std::uint8_t, void* user) {
          static_cast<Client*>(user)->fields[std::string(name, name + name_length)] =
              std::string(value, value + value_length);
          return 0;
        });
    nghttp2_session_callbacks_set_on_data_chunk_recv_callback(
        callbacks, [](nghttp2_session*, std::uint8_t, std::int32_t, const std::uint8_t* data,
                      std::size_t length, void* user) {
          static_cast<Client*>(user)->data.append(data, data + length);
          return 0;
        });
    nghttp2_session_callbacks_set_on_stream_close_callback(
        callbacks, [](nghttp2_session*, std::int32_t, std::uint32_t error, void* user) {
          static_cast<Client*>(user)->closed_with = error;
          return 0;
        });
    nghttp2_session_client_new(&session_, callbacks, this);
    nghttp2_session_callbacks_del(callbacks);
    nghttp2_submit_settings(session_, NGHTTP2_FLAG_NONE, nullptr, 0);
  }
  ~Client() { nghttp2_session_del(session_); }
  Client(const Client&) = delete;

  std::int32_t request(std::string body, std::vector<std::pair<std::string, std::string>> more = {}) {
    body_ = std::move(body);
    sent_ = 0;
    std::vector<std::pair<std::string, std::string>> all{{":method", "POST"},
                                                         {":scheme", "http"},
                                                         {":path", "/axisd.v1.StopService/Stop"},
                                                         {":authority", "machine"},
                                                         {"content-type", "application/grpc"},
                                                         {"te", "trailers"}};
    for (auto& each : more) {
      const auto same = std::ranges::find(all, each.first, &std::pair<std::string, std::string>::first);
      if (same != all.end())
        *same = each;
      else
        all.push_back(each);
    }
    std::vector<nghttp2_nv> list;
    list.reserve(all.size());
    for (auto& [name, value] : all)
      list.push_back({.name = reinterpret_cast<std::uint8_t*>(name.data()),
                      .value = reinterpret_cast<std::uint8_t*>(value.data()),
                      .namelen = name.size(),
                      .valuelen = value.size(),
                      .flags = NGHTTP2_NV_FLAG_NONE});
    const nghttp2_data_provider provider{
        .source = {.ptr = this},
        .read_callback = [](nghttp2_session*, std::int32_t, std::uint8_t* to, std::size_t room,
                            std::uint32_t* flags, nghttp2_data_source* source, void*) -> ssize_t {
          auto& self = *static_cast<Client*>(source->ptr);
          const auto count = std::min(room, self.body_.size() - self.sent_);
          std::copy_n(self.body_.data() + self.sent_, count, to);
          self.sent_ += count;
          if (self.sent_ == self.body_.size()) *flags |= NGHTTP2_DATA_FLAG_EOF;
          return static_cast<ssize_t>(count);
        }};
    return nghttp2_submit_request(session_, nullptr, list.data(), list.size(), &provider, nullptr);
  }
  std::string take_output() {
    std::string bytes;
    const std::uint8_t* piece = nullptr;
    for (ssize_t count = 0; (count = nghttp2_session_mem_send(session_, &piece)) > 0;)
      bytes.append(piece, piece + count);
    return bytes;
  }
  void receive(const std::string& bytes) {
    ASSERT_EQ(
        nghttp2_session_mem_recv(session_, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()),
        static_cast<ssize_t>(bytes.size()));
  }

  std::map<std::string, std::string> fields;
  std::string data;
  std::optional<std::uint32_t> closed_with;

 private:
  nghttp2_session* session_ = nullptr;
  std::string body_;
  std::size_t sent_ = 0;
};

class StopHttp2 : public ::testing::Test {
 protected:
  /// Both sides say all that they have to say; the client's bytes come in pieces of `piece`.
  bool exchange(Client& client, std::size_t piece = 1000) {
    for (;;) {
      const auto up = client.take_output();
      for (std::size_t at = 0; at < up.size(); at += piece)
        if (!http_.receive(up.substr(at, piece), now_)) return false;
      const auto down = http_.take_output();
      client.receive(down);
      if (up.empty() && down.empty()) return true;
    }
  }

  TimePoint now_{};
  std::vector<Http2::Call> calls_;
  Http2 http_{[this](Http2::Call call) { calls_.push_back(std::move(call)); }, now_};
};

TEST_F(StopHttp2, ACallAndItsAnswerInAnyPieces) {
  for (const std::size_t piece : {1U, 7U, 100'000U}) {
    SCOPED_TRACE(piece);
    StopHttp2::now_ = {};
    calls_.clear();
    Http2 http([this](Http2::Call call) { calls_.push_back(std::move(call)); }, now_);
    Client client;
    client.request(framed("hello"), {{"grpc-timeout", "250m"}});
    const auto up = client.take_output();
    for (std::size_t at = 0; at < up.size(); at += piece)
      ASSERT_TRUE(http.receive(up.substr(at, piece), now_));
    ASSERT_EQ(calls_.size(), 1U);
    EXPECT_EQ(calls_[0].path, "/axisd.v1.StopService/Stop");
    EXPECT_EQ(calls_[0].message, "hello");
    EXPECT_EQ(calls_[0].patience, Duration(250ms));
    EXPECT_EQ(http.waiting(), 1);
    http.answer(calls_[0].stream, {.code = 0, .error = {}, .details = {}, .message = "stopped"});
    EXPECT_EQ(http.waiting(), 0);
    client.receive(http.take_output());
    EXPECT_EQ(client.data, framed("stopped"));
    EXPECT_EQ(client.fields[":status"], "200");
    EXPECT_EQ(client.fields["grpc-status"], "0");
    EXPECT_EQ(client.closed_with, 0U);
    http.answer(calls_[0].stream, {.code = 0, .error = {}, .details = {}, .message = "again"});
    EXPECT_TRUE(http.take_output().empty());
  }
}

TEST_F(StopHttp2, AnErrorIsEncoded) {
  Client client;
  client.request(framed(""));
  ASSERT_TRUE(exchange(client));
  ASSERT_EQ(calls_.size(), 1U);
  http_.answer(
      calls_[0].stream,
      {.code = 5, .error = "50 % of \xC3\xBC\n", .details = std::string("\0\x01\xFF", 3), .message = {}});
  ASSERT_TRUE(exchange(client));
  EXPECT_EQ(client.fields["grpc-status"], "5");
  EXPECT_EQ(client.fields["grpc-message"], "50 %25 of %C3%BC%0A");
  EXPECT_EQ(client.fields["grpc-status-details-bin"], "AAH/");
}

TEST_F(StopHttp2, WhatIsNoCallOfGrpcIsRefused) {
  struct Case {
    std::string body;
    std::vector<std::pair<std::string, std::string>> fields;
    std::string status;
  };
  for (const auto& [body, fields, status] :
       {Case{.body = framed("x"), .fields = {{"content-type", "text/html"}}, .status = "3"},
        Case{.body = framed("x"), .fields = {{"grpc-encoding", "gzip"}}, .status = "12"},
        Case{.body = "\1" + framed("x").substr(1), .fields = {}, .status = "12"},
        Case{.body = std::string(3, '\0'), .fields = {}, .status = "3"},
        Case{.body = framed("xy").substr(0, 6), .fields = {}, .status = "3"},
        Case{.body = framed("xy") + framed("z"), .fields = {}, .status = "3"},
        Case{.body = "", .fields = {}, .status = "3"}}) {
    Client client;
    Http2 http([this](Http2::Call call) { calls_.push_back(std::move(call)); }, now_);
    client.request(body, fields);
    ASSERT_TRUE(http.receive(client.take_output(), now_));
    client.receive(http.take_output());
    EXPECT_EQ(client.fields["grpc-status"], status) << body;
  }
  EXPECT_TRUE(calls_.empty());
}

TEST_F(StopHttp2, WhatIsTooLongIsNotKept) {
  Client client;
  client.request(std::string(100'000, 'x'));
  ASSERT_TRUE(exchange(client));
  EXPECT_EQ(client.closed_with, static_cast<std::uint32_t>(NGHTTP2_ENHANCE_YOUR_CALM));
  Client other;
  Http2 http([this](Http2::Call call) { calls_.push_back(std::move(call)); }, now_);
  other.request(framed("x"), {{"x-long", std::string(9000, 'y')}});
  ASSERT_TRUE(http.receive(other.take_output(), now_));
  other.receive(http.take_output());
  EXPECT_TRUE(other.closed_with);
  EXPECT_TRUE(calls_.empty());
}

/// What floods it is cut off after a bounded effort, and keeps nothing.
void expect_cut_off(const std::string& opening, const std::string& repeated, TimePoint now) {
  int calls = 0;
  Http2 http([&](const Http2::Call&) { ++calls; }, now);
  ASSERT_TRUE(http.receive(preface + frame(4, 0, 0, ""), now));
  bool served = http.receive(opening, now);
  std::size_t bytes = 0, answered = 0;
  for (int i = 0; served && i < 200'000; ++i) {
    served = http.receive(repeated, now);
    bytes += repeated.size();
    answered += http.take_output().size();
  }
  EXPECT_FALSE(served);
  EXPECT_LT(bytes, 2'000'000U);
  EXPECT_LT(answered, 200'000U);
  EXPECT_EQ(calls, 0);
}

TEST_F(StopHttp2, FloodsAreCutOff) {
  expect_cut_off("", frame(6, 0, 0, "12345678"), now_);                                    // PING
  expect_cut_off("", frame(4, 0, 0, ""), now_);                                            // SETTINGS
  expect_cut_off("", frame(8, 0, 0, std::string("\0\0\0\1", 4)), now_);                    // WINDOW_UPDATE
  expect_cut_off("", frame(2, 0, 1, std::string("\0\0\0\0\1", 5)), now_);                  // PRIORITY
  expect_cut_off("", frame(0xEE, 0, 0, "unknown"), now_);                                  // of no known type
  expect_cut_off(frame(1, 0, 1, "\x83"), frame(9, 0, 1, std::string(100, '\x83')), now_);  // CONTINUATION
  expect_cut_off("", "GET / HTTP/1.1\r\n\r\n", now_);
}

TEST_F(StopHttp2, RequestsThatAreTakenBackAtOnceAreCutOff) {
  Http2 http([](const Http2::Call&) {}, now_);
  Client client;
  bool served = http.receive(client.take_output(), now_);
  int requests = 0;
  // ":method POST, :scheme http, :path /" by HPACK's static table.
  for (std::uint32_t id = 1; served && requests < 100'000; id += 2, ++requests)
    served =
        http.receive(frame(1, 4, id, "\x83\x86\x84") + frame(3, 0, id, std::string("\0\0\0\x08", 4)), now_);
  EXPECT_FALSE(served);
  EXPECT_LE(requests, 4000);
}

TEST_F(StopHttp2, AnswersThatNobodyTakesAreNotHeapedUp) {
  Http2 http([this](Http2::Call call) { calls_.push_back(std::move(call)); }, now_);
  Client client;
  // Its window is closed: "SETTINGS_INITIAL_WINDOW_SIZE 0".
  ASSERT_TRUE(http.receive(client.take_output() + frame(4, 0, 0, std::string("\0\4\0\0\0\0", 6)), now_));
  bool served = true;
  for (int i = 0; i < 30 && served; ++i) {
    client.request(framed("x"));
    served = http.receive(client.take_output(), now_);
    if (served && !calls_.empty())
      http.answer(calls_.back().stream,
                  {.code = 0, .error = {}, .details = {}, .message = std::string(100'000, 'y')});
    (void)http.take_output();
  }
  EXPECT_FALSE(served);
  EXPECT_LE(calls_.size(), 12U);
}

TEST_F(StopHttp2, AnHonestClientMayGoOnForEver) {
  Client client;
  for (int i = 0; i < 2000; ++i) {
    client.request(framed("x"));
    ASSERT_TRUE(exchange(client)) << i;
    http_.answer(calls_.back().stream, {.code = 0, .error = {}, .details = {}, .message = "y"});
    ASSERT_TRUE(exchange(client)) << i;
    now_ += 20ms;
  }
  EXPECT_EQ(calls_.size(), 2000U);
  EXPECT_EQ(client.fields["grpc-status"], "0");
}

TEST_F(StopHttp2, RandomDamageNeverDoesHarm) {
  std::mt19937 random(11);  // NOLINT(*-msc51-cpp): the same bytes each time
  for (int round = 0; round < 2000; ++round) {
    Client client;
    client.request(framed("hello"));
    auto bytes = client.take_output();
    for (int i = 0; i < 3; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
    int calls = 0;
    Http2 http([&](const Http2::Call&) { ++calls; }, now_);
    (void)http.receive(bytes, now_);
    (void)http.take_output();
    EXPECT_LE(calls, 1);
  }
}

}  // namespace
}  // namespace axisd::testing
