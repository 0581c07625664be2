#include "api/server/system_service.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "api/server/audit_calls.hpp"
#include "api/server/convert.hpp"
#include "api/server/log_level.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/status.hpp"
#include "api/server/stop_requests.hpp"
#include "api/server/validate.hpp"
#include "api/server/value_reply.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {
namespace {

Error no_configuration() {
  return {.reason = Reason::not_supported,
          .message = "this server was not started from a configuration file",
          .remedy = "ask the daemon itself"};
}

void to_proto(const ConfigurationFinding& from, v1::ConfigFinding& to) {
  to.set_line(from.line);
  to.set_column(from.column);
  to.set_message(from.message);
  to.set_suggestion(from.suggestion);
}

void to_proto(const ConfigurationReload& from, v1::ReloadConfigResponse& to) {
  to.set_applied(from.applied);
  for (const auto& found : from.findings) to_proto(found, *to.add_findings());
  for (const auto& warning : from.warnings) to.add_warnings(warning);
  for (const auto& change : from.changes) server::to_proto(change, *to.add_changes());
  for (const auto& refusal : from.refusals) server::to_proto(refusal, *to.add_refusals());
  to.set_previous_revision(from.before);
  to.set_revision(from.revision);
}

void to_proto(KeptFile file, const KeptFileSeen& from, v1::KeptFileState& to) {
  to.set_name(std::string(name_of(file)));
  to.set_generation(from.found);
  to.set_expected(from.expected);
}

void to_proto(const KeptStateReport& from, v1::GetStateResponse& to) {
  to_proto(KeptFile::state, from.seen.state, *to.add_files());
  to_proto(KeptFile::journal, from.seen.journal, *to.add_files());
  for (const auto& conviction : from.convictions) server::to_proto(conviction, *to.add_convictions());
  to.set_start_count(from.start_count);
}

v1::Role to_proto(Role role) {
  switch (role) {
    case Role::none:
      return v1::ROLE_NONE;
    case Role::viewer:
      return v1::ROLE_VIEWER;
    case Role::operator_:
      return v1::ROLE_OPERATOR;
    case Role::maintainer:
      return v1::ROLE_MAINTAINER;
  }
  return v1::ROLE_UNSPECIFIED;
}

void say_who(const Callers& callers, const grpc::CallbackServerContext& context, v1::GetInfoResponse& to) {
  const auto caller = callers.of(context);
  const auto access = callers.access();
  const auto role = role_of(access.get(), caller);
  to.set_client(caller.name);
  to.set_identity(caller.identity);
  to.set_program(callers.peer_of(context).program);
  to.set_role(to_proto(role));
  if (!access) return;
  for (const auto& [axis, roles] : access->axes) {
    const auto here = role_of(access.get(), caller, axis);
    if (here == role) continue;
    auto& entry = *to.add_axis_roles();
    entry.set_axis(axis);
    entry.set_role(to_proto(here));
  }
}

}  // namespace

SystemServiceImpl::SystemServiceImpl(const Services& services)
    : BoundedService(services), services_(services) {
  begin_within_bounds(
      &SystemServiceImpl::GetInfo, &SystemServiceImpl::StopAll, &SystemServiceImpl::ReleaseStopAll,
      &SystemServiceImpl::GetState, &SystemServiceImpl::AcceptState, &SystemServiceImpl::BackUpState,
      &SystemServiceImpl::Explain, &SystemServiceImpl::GetConfig, &SystemServiceImpl::CheckConfig,
      &SystemServiceImpl::ReloadConfig, &SystemServiceImpl::SetLogLevel);
}

grpc::ServerUnaryReactor* SystemServiceImpl::GetInfo(Context* context, const v1::GetInfoRequest*,
                                                     v1::GetInfoResponse* response) {
  const auto info = services_.machine.info();
  response->set_machine(info.machine);
  response->set_version(info.version);
  response->set_instance_id(info.instance_id);
  response->set_inhibited(info.inhibited);
  response->set_inhibited_by(info.inhibited_by);
  response->set_state_unaccepted(info.state_unaccepted);
  if (info.storage_error) server::to_proto(*info.storage_error, *response->mutable_storage_error());
  say_who(services_.callers, *context, *response);
  return answer(context, grpc::Status::OK);
}

grpc::ServerUnaryReactor* SystemServiceImpl::StopAll(Context* context, const v1::StopAllRequest* request,
                                                     v1::StopAllResponse* response) {
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    handle(services_.machine, *request, who_asks(*context, *request), call, response);
  });
}

grpc::ServerUnaryReactor* SystemServiceImpl::ReleaseStopAll(Context* context,
                                                            const v1::ReleaseStopAllRequest*,
                                                            v1::ReleaseStopAllResponse*) {
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        services_.machine.release_inhibit(client, [call, client](const Result<void>& result) {
          const auto error = result ? nullptr : std::make_shared<const Error>(result.error());
          call->complete([error] { return error ? to_status(*error) : grpc::Status::OK; },
                         [client, error] {
                           log_limited(
                               spdlog::level::info, client, "calls",
                               fmt::format("release_stop_all {}", error ? to_string(*error) : "done"));
                         });
        });
      });
}

grpc::ServerUnaryReactor* SystemServiceImpl::GetState(Context* context, const v1::GetStateRequest*,
                                                      v1::GetStateResponse* response) {
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket),
                            [&](const std::shared_ptr<PendingCall>& call) {
                              services_.machine.kept_state([call, response](const KeptStateReport& report) {
                                call->complete([report, response] {
                                  to_proto(report, *response);
                                  return grpc::Status::OK;
                                });
                              });
                            });
}

grpc::ServerUnaryReactor* SystemServiceImpl::AcceptState(Context* context, const v1::AcceptStateRequest*,
                                                         v1::AcceptStateResponse* response) {
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        using All = std::vector<Conviction>;
        services_.machine.accept_state(client, reply_with_value<All>(call, [response](const All& accepted) {
                                         for (const auto& conviction : accepted)
                                           server::to_proto(conviction, *response->add_accepted());
                                       }));
      });
}

grpc::ServerUnaryReactor* SystemServiceImpl::BackUpState(Context* context, const v1::BackUpStateRequest*,
                                                         v1::BackUpStateResponse* response) {
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  if (services_.state_copies == nullptr)
    return answer(context, to_status({.reason = Reason::not_supported,
                                      .message = "this server keeps no state",
                                      .remedy = "ask the daemon itself"}));
  return PendingCall::start(services_, context, *std::move(ticket),
                            [&](const std::shared_ptr<PendingCall>& call) {
                              services_.state_copies->copy_state(reply_with_value<StateCopy>(
                                  call,
                                  [response](const StateCopy& copy) {
                                    response->set_state(copy.text);
                                    response->set_generation(copy.generation);
                                  },
                                  fmt::format("{}: backs up the state", client)));
                            });
}

grpc::ServerUnaryReactor* SystemServiceImpl::Explain(Context* context, const v1::ExplainRequest* request,
                                                     v1::ExplainResponse* response) {
  const auto client = client_of(*context);
  if (auto axis = find_axis(services_.machine, request->axis()); !axis)
    return answer(context, to_status(axis.error()));
  auto question = question_of(*request, client, services_.machine);
  if (!question) return answer(context, to_status(question.error()));
  auto ticket = services_.admission.admit(client, Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        services_.machine.explain(
            request->axis(), std::move(question->action), std::move(question->options),
            reply_with_value<std::vector<Obstacle>>(call, [response](const std::vector<Obstacle>& found) {
              for (const auto& obstacle : found) {
                auto& entry = *response->add_obstacles();
                entry.set_blocking(obstacle.blocking);
                to_proto(obstacle.error, *entry.mutable_detail());
              }
            }));
      });
}

grpc::ServerUnaryReactor* SystemServiceImpl::GetConfig(Context* context, const v1::GetConfigRequest*,
                                                       v1::GetConfigResponse* response) {
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  if (services_.configuration == nullptr) return answer(context, to_status(no_configuration()));
  const auto served = services_.configuration->served();
  response->set_yaml(served->yaml);
  response->set_path(served->path);
  response->set_revision(served->revision);
  server::to_proto(served->served_since, *response->mutable_served_since());
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        services_.configuration->file_revision(reply_with_value<std::string>(
            call, [response](const std::string& revision) { response->set_file_revision(revision); }));
      });
}

grpc::ServerUnaryReactor* SystemServiceImpl::CheckConfig(Context* context,
                                                         const v1::CheckConfigRequest* request,
                                                         v1::CheckConfigResponse* response) {
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  if (services_.configuration == nullptr) return answer(context, to_status(no_configuration()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        services_.configuration->check(
            request->yaml(),
            reply_with_value<ConfigurationCheck>(call, [response](const ConfigurationCheck& checked) {
              for (const auto& found : checked.findings) to_proto(found, *response->add_findings());
              for (const auto& warning : checked.warnings) response->add_warnings(warning);
              response->set_revision(checked.revision);
            }));
      });
}

grpc::ServerUnaryReactor* SystemServiceImpl::ReloadConfig(Context* context,
                                                          const v1::ReloadConfigRequest* request,
                                                          v1::ReloadConfigResponse* response) {
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  if (services_.configuration == nullptr) return answer(context, to_status(no_configuration()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        services_.configuration->reload(
            client, request->dry_run(),
            reply_with_value<ConfigurationReload>(
                call, [response](const ConfigurationReload& reload) { to_proto(reload, *response); }));
      });
}

grpc::ServerUnaryReactor* SystemServiceImpl::SetLogLevel(Context* context,
                                                         const v1::SetLogLevelRequest* request,
                                                         v1::SetLogLevelResponse* response) {
  const auto caller = who_asks(*context, *request);
  auto ticket = services_.admission.admit(caller.name, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  const auto before = log_level();
  const auto after = request->level() == v1::LOG_LEVEL_UNSPECIFIED ? before : request->level();
  if (!v1::LogLevel_IsValid(after))
    return answer(context, to_status({.reason = Reason::invalid_argument,
                                      .message = fmt::format("level {} is not known here", int{after}),
                                      .remedy = "use one of trace, debug, info, warn, error"}));
  response->set_previous(before);
  response->set_level(after);
  if (after == before) return answer(context, grpc::Status::OK);
  record(services_.machine, services_.audit_sink,
         AuditedCall{.phase = AuditedCall::Phase::done,
                     .rpc = "SystemService.SetLogLevel",
                     .client = caller.name,
                     .text = change_log_level(before, after, caller.name),
                     .origin = caller.origin});
  return answer(context, grpc::Status::OK);
}

}  // namespace axisd::server
