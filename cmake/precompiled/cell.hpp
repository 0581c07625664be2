// The entrance of a cell: the standard library, gRPC and the messages that nearly all of its files see.
#pragma once

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/cell/kept.pb.h"
#include "axisd/cell/v1/cell_service.grpc.pb.h"
#include "axisd/v1/system_service.pb.h"
#include "buses/clock.hpp"
#include "buses/error.hpp"
