// The contract's messages and services.
#pragma once

#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/command_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "axisd/v1/group_service.grpc.pb.h"
#include "axisd/v1/lease_service.grpc.pb.h"
#include "axisd/v1/stop_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"
#include "cmake/precompiled/proto.hpp"
