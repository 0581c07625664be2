#include "api/web/gateway/upstream.hpp"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>

#include <boost/asio/post.hpp>
#include <fstream>
#include <iterator>
#include <utility>

namespace axisd::web {
namespace {

/// The daemon's stop lane takes 100 calls of a connection at once; the others would wait, stops as well.
constexpr int most_at_lane = 80, most_moves_at_lane = 48;
/// It cuts off a connection that makes more than some 500 calls in a second. Ten renewals a second hold a
/// button.
constexpr Pace all_moves{.per_second = 300, .at_once = 600}, moves_of_one{.per_second = 60, .at_once = 120};
constexpr Pace all_stops{.per_second = 150, .at_once = 600};

Result<std::string> read_pem(const std::string& path) {
  if (path.empty()) return std::string();
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file || text.empty())
    return fail(Reason::invalid_argument, fmt::format("{}: cannot be read", path), "check axisd.tls");
  return text;
}

Result<std::shared_ptr<grpc::ChannelCredentials>> credentials(const DaemonSettings& settings) {
  if (settings.ca.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions options;
  for (const auto& [path, text] : {std::pair(&settings.ca, &options.pem_root_certs),
                                   std::pair(&settings.certificate, &options.pem_cert_chain),
                                   std::pair(&settings.key, &options.pem_private_key)}) {
    auto read = read_pem(*path);
    if (!read) return fail(std::move(read).error());
    *text = *std::move(read);
  }
  return grpc::SslCredentials(options);
}

grpc::ChannelArguments arguments() {
  grpc::ChannelArguments arguments;
  // The daemon permits one ping per second; faster ones are answered with GOAWAY.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 2000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 1000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // An http_proxy of the environment must not redirect commands to a machine.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // A call that failed is reported, never sent again behind somebody's back: only stops are.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return arguments;
}

std::vector<std::pair<std::string, std::string>> metadata_of(const Person& person) {
  if (person.how == How::loopback) return {};
  return {{"axisd-user", person.name}, {"axisd-role", person.role}};
}

/// Another address may have what this one has not.
bool is_for_another(const CallStatus& status) {
  return status.code == code::unavailable || status.code == code::unimplemented;
}

}  // namespace

Result<std::unique_ptr<Upstream>> Upstream::make(boost::asio::any_io_executor executor, const Clock& clock,
                                                 const DaemonSettings& settings) {
  auto trusted = credentials(settings);
  if (!trusted) return fail(std::move(trusted).error());
  return std::unique_ptr<Upstream>(new Upstream(std::move(executor), clock, settings, *trusted));
}

Upstream::Upstream(boost::asio::any_io_executor executor, const Clock& clock, const DaemonSettings& settings,
                   const std::shared_ptr<grpc::ChannelCredentials>& trusted)
    : executor_(std::move(executor)),
      clock_(clock),
      settings_(settings),
      moves_(all_moves, moves_of_one),
      stops_(all_stops) {
  if (settings_.stop_server.empty()) settings_.stop_server = stop_lane_next_to(settings_.server);
  const auto connect = [&](Link& link, const std::string& address) {
    link.channel = grpc::CreateCustomChannel(address, trusted, arguments());
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
  return Call::start(
      executor_, *main_.stub,
      {.path = path, .message = to_buffer(message), .metadata = metadata_of(person), .timeout = timeout},
      std::move(events), open_);
}

void Upstream::ask_at(Link& link, std::string path, std::string_view message, const Person& person,
                      Duration timeout, Done done) {
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
}

void Upstream::ask(LaneMethod method, std::string_view message, const Person& person, Duration timeout,
                   Done done) {
  const bool stop = is_stop(method);
  const bool reachable = lane_.channel->GetState(true) == GRPC_CHANNEL_READY;
  const auto now = clock_.now();
  const bool room = stop ? at_lane_ < most_at_lane && stops_.take(now)
                         : at_lane_ < most_moves_at_lane && moves_.take(person.key(), now);
  if (!stop && (!reachable || !room)) {
    CallStatus why{.code = reachable ? code::resource_exhausted : code::unavailable,
                   .message = reachable ? "too many presses wait for their answers"
                                        : "the stop lane of axisd does not answer"};
    boost::asio::post(executor_, [done = std::move(done), why = std::move(why)] { done(why, {}); });
    return;
  }
  if (!reachable || !room)
    return ask_at(main_, std::string(main_path_of(method)), message, person, timeout, std::move(done));
  ++at_lane_;
  ask_at(lane_, fmt::format("/axisd.v1.StopService/{}", name_of(method)), message, person, timeout,
         [this, method, stop, person, timeout, message = std::string(stop ? message : std::string_view()),
          done = std::move(done)](const CallStatus& status, const std::string& response) {
           --at_lane_;
           if (stop && is_for_another(status))
             ask_at(main_, std::string(main_path_of(method)), message, person, timeout, done);
           else
             done(status, response);
         });
}

void Upstream::stay_connected() {
  for (auto* link : {&main_, &lane_}) {
    if (link->channel->GetState(true) == GRPC_CHANNEL_READY || link->probing) continue;
    link->probing = true;
    ask_at(*link, link->probe, {}, {.name = {}, .role = {}, .how = How::loopback}, std::chrono::seconds(1),
           [link](const CallStatus&, const std::string&) { link->probing = false; });
  }
}

std::string Upstream::trouble() const {
  if (main_.channel->GetState(false) != GRPC_CHANNEL_READY)
    return fmt::format("axisd does not answer at {}", settings_.server);
  if (lane_.channel->GetState(false) != GRPC_CHANNEL_READY)
    return fmt::format("the stop lane of axisd does not answer at {}", settings_.stop_server);
  return {};
}

}  // namespace axisd::web
