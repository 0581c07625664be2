#include "api/server/lane/http2.hpp"

#include <absl/strings/escaping.h>
#include <fmt/format.h>
#include <nghttp2/nghttp2.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include "api/grpc_text/grpc_text.hpp"

namespace axisd::server::lane {

namespace {

constexpr std::size_t prefix = 5;  // of a gRPC message: compressed or not, and its length
// Codes of gRPC's status.
constexpr int invalid_argument = 3, unimplemented = 12;

void check(int result, const char* what) {
  if (result != 0) throw std::runtime_error(fmt::format("{}: {}", what, nghttp2_strerror(result)));
}

nghttp2_nv field(std::string_view name, std::string_view value) {
  // nghttp2 copies both; its interface is older than const.
  return {.name = reinterpret_cast<std::uint8_t*>(const_cast<char*>(name.data())),
          .value = reinterpret_cast<std::uint8_t*>(const_cast<char*>(value.data())),
          .namelen = name.size(),
          .valuelen = value.size(),
          .flags = NGHTTP2_NV_FLAG_NONE};
}

std::string framed(std::string_view message) {
  std::string bytes(prefix, '\0');
  for (std::size_t i = 0; i < 4; ++i)
    bytes[1 + i] = static_cast<char>((message.size() >> (8 * (3 - i))) & 0xFFU);
  return bytes.append(message);
}

std::size_t length_of(std::string_view body) {
  std::size_t length = 0;
  for (std::size_t i = 1; i < prefix; ++i) length = (length << 8U) | static_cast<unsigned char>(body[i]);
  return length;
}

struct SessionCallbacks {
  nghttp2_session_callbacks* set = nullptr;
  SessionCallbacks() { check(nghttp2_session_callbacks_new(&set), "nghttp2 callbacks"); }
  ~SessionCallbacks() { nghttp2_session_callbacks_del(set); }
  SessionCallbacks(const SessionCallbacks&) = delete;
};

struct SessionOptions {
  nghttp2_option* set = nullptr;
  SessionOptions() { check(nghttp2_option_new(&set), "nghttp2 options"); }
  ~SessionOptions() { nghttp2_option_del(set); }
  SessionOptions(const SessionOptions&) = delete;
};

}  // namespace

struct Http2::Stream {
  std::string path, body;
  std::optional<Duration> patience;
  Claim claim;
  std::size_t headers = 0;
  bool is_grpc = false, compressed = false;
  bool handed_out = false;  ///< to on_call_, and not answered yet
  bool answered = false;
  Answer answer;
  std::string out;  ///< the answer's message, framed
  std::size_t sent = 0;
};

struct Http2::Callbacks {
  static Http2& self(void* user) { return *static_cast<Http2*>(user); }
  static Stream* find(Http2& http, std::int32_t id) {
    const auto found = http.streams_.find(id);
    return found == http.streams_.end() ? nullptr : &found->second;
  }

  static int begin_frame(nghttp2_session*, const nghttp2_frame_hd*, void* user) {
    self(user).spend(1);
    return 0;
  }

  static int begin_headers(nghttp2_session*, const nghttp2_frame* frame, void* user) {
    if (frame->hd.type == NGHTTP2_HEADERS && frame->headers.cat == NGHTTP2_HCAT_REQUEST)
      self(user).streams_.try_emplace(frame->hd.stream_id);
    return 0;
  }

  static int header(nghttp2_session*, const nghttp2_frame* frame, const std::uint8_t* name,
                    std::size_t name_length, const std::uint8_t* value, std::size_t value_length,
                    std::uint8_t, void* user) {
    auto& http = self(user);
    const auto size = name_length + value_length + 32;  // as SETTINGS_MAX_HEADER_LIST_SIZE counts
    http.spend(static_cast<double>(size) / 128);
    auto* stream = find(http, frame->hd.stream_id);
    if (stream == nullptr) return NGHTTP2_ERR_TEMPORAL_CALLBACK_FAILURE;
    stream->headers += size;
    if (stream->headers > largest_headers) return NGHTTP2_ERR_TEMPORAL_CALLBACK_FAILURE;
    const std::string_view key(reinterpret_cast<const char*>(name), name_length);
    const std::string_view text(reinterpret_cast<const char*>(value), value_length);
    if (key == ":path") {
      stream->path = text;
    } else if (key == "content-type") {
      stream->is_grpc = text.starts_with("application/grpc");
    } else if (key == "grpc-timeout") {
      stream->patience = grpc_text::timeout_of(text);
    } else if (key == "grpc-encoding") {
      stream->compressed = text != "identity";
    } else if (key == user_key) {
      stream->claim.user = text;
    } else if (key == role_key) {
      stream->claim.role = text;
    }
    return 0;
  }

  static int data(nghttp2_session* session, std::uint8_t, std::int32_t id, const std::uint8_t* bytes,
                  std::size_t length, void* user) {
    auto* stream = find(self(user), id);
    if (stream == nullptr || stream->answered) return 0;
    if (stream->body.size() + length > prefix + largest_message) {
      stream->body.clear();
      stream->answered = true;
      return nghttp2_submit_rst_stream(session, NGHTTP2_FLAG_NONE, id, NGHTTP2_ENHANCE_YOUR_CALM);
    }
    stream->body.append(reinterpret_cast<const char*>(bytes), length);
    return 0;
  }

  static int frame(nghttp2_session*, const nghttp2_frame* frame, void* user) {
    const bool may_end = frame->hd.type == NGHTTP2_HEADERS || frame->hd.type == NGHTTP2_DATA;
    if (!may_end || (frame->hd.flags & NGHTTP2_FLAG_END_STREAM) == 0) return 0;
    auto& http = self(user);
    if (auto* stream = find(http, frame->hd.stream_id)) http.complete(frame->hd.stream_id, *stream);
    return 0;
  }

  static int close(nghttp2_session*, std::int32_t id, std::uint32_t, void* user) {
    auto& http = self(user);
    const auto* stream = find(http, id);
    if (stream == nullptr) return 0;
    if (stream->handed_out) --http.waiting_;
    http.unsent_ -= stream->out.size() - stream->sent;
    http.streams_.erase(id);
    return 0;
  }

  static ssize_t read(nghttp2_session* session, std::int32_t id, std::uint8_t* to, std::size_t room,
                      std::uint32_t* flags, nghttp2_data_source*, void* user) {
    auto* stream = find(self(user), id);
    if (stream == nullptr) return NGHTTP2_ERR_TEMPORAL_CALLBACK_FAILURE;
    const auto count = std::min(room, stream->out.size() - stream->sent);
    std::copy_n(stream->out.begin() + static_cast<std::ptrdiff_t>(stream->sent), count, to);
    stream->sent += count;
    self(user).unsent_ -= count;
    if (stream->sent < stream->out.size()) return static_cast<ssize_t>(count);
    *flags |= NGHTTP2_DATA_FLAG_EOF | NGHTTP2_DATA_FLAG_NO_END_STREAM;
    const auto trailer = field("grpc-status", "0");
    if (nghttp2_submit_trailer(session, id, &trailer, 1) != 0) return NGHTTP2_ERR_TEMPORAL_CALLBACK_FAILURE;
    return static_cast<ssize_t>(count);
  }
};

void Http2::Free::operator()(nghttp2_session* session) const { nghttp2_session_del(session); }

Http2::Http2(OnCall on_call, TimePoint now) : on_call_(std::move(on_call)), refilled_(now) {
  const SessionCallbacks callbacks;
  nghttp2_session_callbacks_set_on_begin_frame_callback(callbacks.set, &Callbacks::begin_frame);
  nghttp2_session_callbacks_set_on_begin_headers_callback(callbacks.set, &Callbacks::begin_headers);
  nghttp2_session_callbacks_set_on_header_callback(callbacks.set, &Callbacks::header);
  nghttp2_session_callbacks_set_on_data_chunk_recv_callback(callbacks.set, &Callbacks::data);
  nghttp2_session_callbacks_set_on_frame_recv_callback(callbacks.set, &Callbacks::frame);
  nghttp2_session_callbacks_set_on_stream_close_callback(callbacks.set, &Callbacks::close);
  const SessionOptions options;
  nghttp2_option_set_max_outbound_ack(options.set, 100);
  nghttp2_option_set_max_settings(options.set, 16);
  nghttp2_session* session = nullptr;
  check(nghttp2_session_server_new2(&session, callbacks.set, this, options.set), "nghttp2 session");
  session_.reset(session);
  const std::array settings{
      nghttp2_settings_entry{NGHTTP2_SETTINGS_MAX_CONCURRENT_STREAMS, most_streams},
      nghttp2_settings_entry{NGHTTP2_SETTINGS_MAX_HEADER_LIST_SIZE, largest_headers},
      nghttp2_settings_entry{NGHTTP2_SETTINGS_INITIAL_WINDOW_SIZE, prefix + largest_message},
  };
  check(nghttp2_submit_settings(session, NGHTTP2_FLAG_NONE, settings.data(), settings.size()),
        "nghttp2 settings");
}

Http2::~Http2() = default;

double Http2::effort_left(TimePoint now) const {
  const auto passed = std::chrono::duration<double>(now - refilled_).count();
  return std::min(effort_at_once, effort_ + std::max(0.0, passed) * effort_per_second);
}

bool Http2::receive(std::string_view bytes, TimePoint now) {
  effort_ = effort_left(now);
  refilled_ = now;
  // In pieces, so that one call cannot spend many times what there is.
  constexpr std::size_t piece = 1024;
  for (; !bytes.empty() && effort_ > 0; bytes.remove_prefix(std::min(piece, bytes.size()))) {
    const auto part = bytes.substr(0, piece);
    spend(static_cast<double>(part.size()) / 128);  // frames of unknown kinds are seen nowhere else
    const auto taken = nghttp2_session_mem_recv(
        session_.get(), reinterpret_cast<const std::uint8_t*>(part.data()), part.size());
    if (taken != static_cast<ssize_t>(part.size())) return false;
  }
  if (effort_ > 0)
    return nghttp2_session_want_read(session_.get()) != 0 || nghttp2_session_want_write(session_.get()) != 0;
  nghttp2_session_terminate_session(session_.get(), NGHTTP2_ENHANCE_YOUR_CALM);
  return false;
}

void Http2::complete(std::int32_t id, Stream& stream) {
  if (stream.answered || stream.handed_out) return;
  const auto refuse = [&](int code, std::string_view why) {
    answer(id, {.code = code, .error = std::string(why), .details = {}, .message = {}});
  };
  if (!stream.is_grpc) return refuse(invalid_argument, "this is no gRPC call: the content type is another");
  const auto& body = stream.body;
  if (stream.compressed || (!body.empty() && body.front() != 0))
    return refuse(unimplemented, "stops are taken uncompressed only");
  if (body.size() < prefix || length_of(body) != body.size() - prefix)
    return refuse(invalid_argument, "a call here has exactly one message");
  stream.handed_out = true;
  ++waiting_;
  on_call_({.stream = id,
            .path = stream.path,
            .message = std::exchange(stream.body, {}).substr(prefix),
            .patience = stream.patience,
            .claim = std::move(stream.claim)});
}

void Http2::answer(std::int32_t id, Answer answer) {
  const auto found = streams_.find(id);
  if (found == streams_.end() || found->second.answered) return;
  auto& stream = found->second;
  if (std::exchange(stream.handed_out, false)) --waiting_;
  stream.answered = true;
  stream.answer = std::move(answer);
  submit_answer(id, stream);
}

void Http2::submit_answer(std::int32_t id, Stream& stream) {
  const auto& said = stream.answer;
  std::vector<nghttp2_nv> fields{field(":status", "200"), field("content-type", "application/grpc")};
  if (said.code == 0) {
    stream.out = framed(std::exchange(stream.answer.message, {}));
    unsent_ += stream.out.size();
    if (unsent_ > most_unsent)
      return (void)nghttp2_session_terminate_session(session_.get(), NGHTTP2_ENHANCE_YOUR_CALM);
    const nghttp2_data_provider provider{.source = {.ptr = nullptr}, .read_callback = &Callbacks::read};
    (void)nghttp2_submit_response(session_.get(), id, fields.data(), fields.size(), &provider);
    return;
  }
  const auto code = fmt::format("{}", said.code), text = grpc_text::percent_encoded(said.error);
  const auto details = absl::Base64Escape(said.details);
  fields.push_back(field("grpc-status", code));
  fields.push_back(field("grpc-message", text));
  if (!details.empty()) fields.push_back(field("grpc-status-details-bin", details));
  (void)nghttp2_submit_response(session_.get(), id, fields.data(), fields.size(), nullptr);
}

void Http2::go_away() { (void)nghttp2_session_terminate_session(session_.get(), NGHTTP2_NO_ERROR); }

std::string Http2::take_output(std::size_t most) {
  std::string bytes;
  while (bytes.size() < most) {
    const std::uint8_t* piece = nullptr;
    const auto count = nghttp2_session_mem_send(session_.get(), &piece);
    if (count <= 0) break;
    bytes.append(reinterpret_cast<const char*>(piece), static_cast<std::size_t>(count));
  }
  return bytes;
}

}  // namespace axisd::server::lane
