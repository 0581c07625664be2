#include "api/web/gateway/upstream.hpp"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>
#include <spdlog/spdlog.h>

#include <boost/asio/post.hpp>
#include <utility>

#include "api/transport/address.hpp"
#include "api/transport/channel.hpp"

namespace axisd::web {
namespace {

std::vector<std::pair<std::string, std::string>> metadata_of(const Person& person) {
  if (person.how == How::loopback) return {};
  return {{"axisd-user", person.name}, {"axisd-role", person.role}};
}

/// gRPC's text for a failed connection is a list of wrapped errors, the last one being the reason.
std::string_view innermost(std::string_view text) {
  constexpr std::string_view mark = "last error: ";
  if (const auto at = text.rfind(mark); at != text.npos) text.remove_prefix(at + mark.size());
  return text;
}

/// Another address may have what this one has not. What the daemon itself says has details.
bool is_for_another(const CallStatus& status) {
  return status.details.empty() && (status.code == code::unavailable || status.code == code::unimplemented);
}

}  // namespace

Result<std::unique_ptr<Upstream>> Upstream::make(boost::asio::any_io_executor executor, const Clock& clock,
                                                 const DaemonSettings& settings) {
  auto trusted = transport::client_credentials(
      {.ca = settings.ca, .certificate = settings.certificate, .key = settings.key}, "axisd.tls");
  if (!trusted) return fail(std::move(trusted).error());
  return std::unique_ptr<Upstream>(new Upstream(std::move(executor), clock, settings, *trusted));
}

Upstream::Upstream(boost::asio::any_io_executor executor, const Clock& clock, const DaemonSettings& settings,
                   const std::shared_ptr<grpc::ChannelCredentials>& trusted)
    : executor_(std::move(executor)), clock_(clock), settings_(settings) {
  if (settings_.stop_server.empty()) settings_.stop_server = transport::stop_lane_next_to(settings_.server);
  const auto connect = [&](Link& link, const std::string& address) {
    link.channel = grpc::CreateCustomChannel(address, trusted, transport::client_arguments());
    link.stub = std::make_unique<grpc::GenericStub>(link.channel);
  };
  connect(main_, settings_.server);
  connect(lane_, settings_.stop_server);
  main_.probe = "/axisd.v1.SystemService/GetInfo";
  lane_.probe = "/axisd.v1.StopService/Nothing";  // which it has not
  stay_connected();
}

std::shared_ptr<Call> Upstream::start(const std::string& path, std::string_view message, const Person& person,
                                      std::optional<Duration> timeout, Call::Events events) {
  if (person.how != How::loopback)
    events.done = [this, done = std::move(events.done)](CallStatus status) {
      note_answer(status);
      done(std::move(status));
    };
  return Call::start(
      executor_, *main_.stub,
      {.path = path, .message = to_buffer(message), .metadata = metadata_of(person), .timeout = timeout},
      std::move(events), open_);
}

std::shared_ptr<Call> Upstream::ask_at(Link& link, std::string path, std::string_view message,
                                       const Person& person, Duration timeout, Done done) {
  struct Answer {
    std::shared_ptr<Call> call;
    std::string response;
  };
  const auto answer = std::make_shared<Answer>();
  answer->call = Call::start(executor_, *link.stub,
                             {.path = std::move(path),
                              .message = to_buffer(message),
                              .metadata = metadata_of(person),
                              .timeout = timeout},
                             {.message =
                                  [answer](const grpc::ByteBuffer& part) {
                                    answer->response.clear();
                                    append(answer->response, part);
                                    answer->call->next();
                                  },
                              .done =
                                  [answer, done = std::move(done)](const CallStatus& status) {
                                    answer->call.reset();
                                    done(status, answer->response);
                                  }},
                             open_);
  return answer->call;
}

void Upstream::ask(LaneMethod method, std::string_view message, const Person& person, Duration timeout,
                   Done done) {
  if (is_stop(method))
    stop(method, message, person, timeout, std::move(done));
  else if (!is_at_stop_lane(method))
    start_at_main(method, message, person, timeout, std::move(done));
  else
    press(method, message, person, timeout, std::move(done));
}

void Upstream::press(LaneMethod method, std::string_view message, const Person& person, Duration timeout,
                     Done done) {
  const bool reachable = lane_.channel->GetState(true) == GRPC_CHANNEL_READY;
  auto room = reachable ? room_.move(person.key(), message.size(), clock_.now()) : std::nullopt;
  if (!room) {
    CallStatus why{.code = reachable ? code::resource_exhausted : code::unavailable,
                   .message = reachable ? "too many presses wait for their answers, or this one is too large"
                                        : "the stop lane of axisd does not answer",
                   .not_sent = true};
    boost::asio::post(executor_, [done = std::move(done), why = std::move(why)] { done(why, {}); });
    return;
  }
  const auto number = ++last_press_;
  auto call =
      ask_at(lane_, fmt::format("/axisd.v1.StopService/{}", name_of(method)), message, person, timeout,
             [this, number, place = std::make_shared<LaneRoom::Place>(*std::move(room)),
              done = std::move(done)](const CallStatus& status, const std::string& response) mutable {
               place.reset();
               presses_.erase(number);
               done(status, response);
             });
  if (method == LaneMethod::jog)
    presses_.emplace(number, Press{.who = person.key(), .call = std::move(call)});
}

void Upstream::start_at_main(LaneMethod method, std::string_view message, const Person& person,
                             Duration timeout, Done done) {
  const bool reachable = main_.channel->GetState(true) == GRPC_CHANNEL_READY;
  auto room = reachable ? starts_.take(person.key()) : std::nullopt;
  if (!room) {
    CallStatus why{.code = reachable ? code::resource_exhausted : code::unavailable,
                   .message = reachable ? "too many starts wait for their answers" : "axisd does not answer",
                   .not_sent = true};
    boost::asio::post(executor_, [done = std::move(done), why = std::move(why)] { done(why, {}); });
    return;
  }
  (void)ask_at(main_, std::string(main_path_of(method)), message, person, timeout,
               [place = std::make_shared<Shares::Place>(*std::move(room)), done = std::move(done)](
                   const CallStatus& status, const std::string& response) mutable {
                 place.reset();
                 done(status, response);
               });
}

void Upstream::stop(LaneMethod method, std::string_view message, const Person& person, Duration timeout,
                    Done done) {
  const bool reachable = lane_.channel->GetState(true) == GRPC_CHANNEL_READY;
  auto room = reachable ? room_.stop(person.key(), message.size(), clock_.now()) : std::nullopt;
  if (!room) {
    abort_presses(reachable ? std::optional(person.key()) : std::nullopt);
    return stop_at_main(method, message, person, timeout, std::move(done));
  }
  (void)ask_at(lane_, fmt::format("/axisd.v1.StopService/{}", name_of(method)), message, person, timeout,
               [this, method, person, timeout, message = std::string(message),
                place = std::make_shared<LaneRoom::Place>(*std::move(room)),
                done = std::move(done)](const CallStatus& status, const std::string& response) mutable {
                 place.reset();
                 if (!is_for_another(status)) return done(status, response);
                 abort_presses(std::nullopt);
                 stop_at_main(method, message, person, timeout, std::move(done));
               });
}

void Upstream::stop_at_main(LaneMethod method, std::string_view message, const Person& person,
                            Duration timeout, Done done) {
  (void)ask_at(main_, std::string(main_path_of(method)), message, person, timeout, std::move(done));
}

void Upstream::abort_presses(const std::optional<std::string>& who) {
  for (const auto& [number, press] : presses_)
    if (!who || press.who == *who) press.call->abort();
}

void Upstream::stay_connected() {
  for (auto* link : {&main_, &lane_}) {
    if (link->channel->GetState(true) == GRPC_CHANNEL_READY || link->probing) continue;
    link->probing = true;
    link->why.clear();
    (void)ask_at(*link, link->probe, {}, {.name = {}, .role = {}, .how = How::loopback},
                 std::chrono::seconds(1), [link](const CallStatus& status, const std::string&) {
                   link->probing = false;
                   link->why = innermost(status.message);
                 });
  }
}

const Upstream::Link* Upstream::broken() const {
  for (const auto* link : {&main_, &lane_})
    if (link->channel->GetState(false) != GRPC_CHANNEL_READY) return link;
  return nullptr;
}

std::string Upstream::trouble() const {
  const auto* link = broken();
  if (link == nullptr) return {};
  return link == &main_ ? fmt::format("axisd does not answer at {}", settings_.server)
                        : fmt::format("the stop lane of axisd does not answer at {}", settings_.stop_server);
}

void Upstream::tell_trouble() {
  const auto now = trouble();
  // What lasts from one look to the next: by then it is known why, and a daemon that is restarted is back.
  if (std::exchange(trouble_seen_, now) != now || now == trouble_told_) return;
  trouble_told_ = now;
  if (const auto* link = broken(); link != nullptr)
    spdlog::warn("{}{}{}", trouble_told_, link->why.empty() ? "" : ": ", link->why);
  else
    spdlog::info("axisd answers at {}", settings_.server);
}

void Upstream::note_answer(const CallStatus& status) {
  // Whatever a person asks for is refused then: it is the daemon's configuration that is wrong.
  if (refusal_told_ || status.code != code::permission_denied ||
      !status.message.contains("may not speak for others"))
    return;
  refusal_told_ = true;
  spdlog::warn("axisd at {} refuses whoever has logged in: {}", settings_.server, status.message);
}

}  // namespace axisd::web
