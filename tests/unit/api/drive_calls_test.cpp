// DriveService and BusService through a real connection.
#include <gmock/gmock.h>

#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class DriveCalls : public Serving {
 protected:
  void SetUp() override {
    serve();
    drives_ = v1::DriveService::NewStub(channel_);
    buses_ = v1::BusService::NewStub(channel_);
  }
  template <class Stub, class Request, class Response>
  grpc::Status call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response& response) {
    Call context;
    return (stub.*method)(&context, request, &response);
  }

  std::unique_ptr<v1::DriveService::Stub> drives_;
  std::unique_ptr<v1::BusService::Stub> buses_;
};

using Drives = v1::DriveService::Stub;
using Buses = v1::BusService::Stub;

TEST_F(DriveCalls, CatalogueComesFromTheModelAndNamesItsOwners) {
  v1::ListParametersRequest request;
  request.set_axis("feeder");
  v1::ListParametersResponse response;
  ASSERT_TRUE(call(*drives_, &Drives::ListParameters, request, response).ok());
  EXPECT_EQ(response.model(), "ykd2405pr");
  EXPECT_EQ(response.parameters_size(), static_cast<int>(find_drive_model("ykd2405pr")->parameters.size()));
  for (const auto& parameter : response.parameters()) {
    EXPECT_EQ(parameter.configured_by(), parameter.address() == 0x11 ? "scale.microstep" : "");
    EXPECT_EQ(parameter.instead().empty(), parameter.access() != v1::PARAMETER_ACCESS_WRITE_ONLY);
    EXPECT_FALSE(parameter.description().empty()) << parameter.name();
  }
  EXPECT_THAT(machine_.drives().log(), ElementsAre("drive_info feeder"));
}

TEST_F(DriveCalls, DriveIsDescribed) {
  v1::GetDriveRequest request;
  request.set_axis("feeder");
  v1::GetDriveResponse response;
  ASSERT_TRUE(call(*drives_, &Drives::GetDrive, request, response).ok());
  EXPECT_EQ(response.model_code(), 0x301U);
  EXPECT_EQ(response.version(), "V1.0");
  EXPECT_EQ(response.eeprom_writes(), 3U);
  EXPECT_TRUE(response.persist());
  EXPECT_FALSE(response.closed_loop());
  EXPECT_EQ(response.homing_methods_size(), 4);
  EXPECT_GT(response.alarms_size(), 0);
  ASSERT_GT(response.inputs_size(), 0);
  EXPECT_GT(response.inputs(0).functions_size(), 1);
}

TEST_F(DriveCalls, ParametersAreReadAndWrittenByName) {
  v1::ReadParametersRequest read;
  read.set_axis("feeder");
  read.add_names("lock_current");
  read.add_names("current");
  v1::ReadParametersResponse values;
  ASSERT_TRUE(call(*drives_, &Drives::ReadParameters, read, values).ok());
  ASSERT_EQ(values.values_size(), 2);
  EXPECT_EQ(values.values(0).name(), "lock_current");
  EXPECT_EQ(values.values(0).address(), 0x12U);
  EXPECT_EQ(values.values(0).value(), -0x13);  // negative numbers arrive as such
  v1::WriteParametersRequest write;
  write.set_axis("feeder");
  write.add_values()->set_name("current");
  write.mutable_values(0)->set_value(5);
  v1::WriteParametersResponse written;
  ASSERT_TRUE(call(*drives_, &Drives::WriteParameters, write, written).ok());
  EXPECT_EQ(written.values(0).value(), 5);
  EXPECT_THAT(machine_.drives().log(), ElementsAre("read_parameters feeder 0x12 0x10",
                                                   "write_parameters feeder by " + own_name() + " 0x10=5"));
}

TEST_F(DriveCalls, BadBatchesReachNothing) {
  v1::WriteParametersRequest write;
  write.set_axis("feeder");
  v1::WriteParametersResponse response;
  for (const auto* name : {"start", "moving", "nonsense", "current"}) {
    write.clear_values();
    write.add_values()->set_name("lock_current");
    write.add_values()->set_name(name);
    write.mutable_values(1)->set_value(99);
    const auto status = call(*drives_, &Drives::WriteParameters, write, response);
    EXPECT_EQ(status.error_code(), std::string_view(name) == "current" ? grpc::StatusCode::OUT_OF_RANGE
                                                                       : grpc::StatusCode::INVALID_ARGUMENT)
        << name;
  }
  write.set_axis("nobody");
  EXPECT_EQ(call(*drives_, &Drives::WriteParameters, write, response).error_code(),
            grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(machine_.drives().log(), ElementsAre());
}

TEST_F(DriveCalls, RefusalsOfTheCoreKeepTheirAddress) {
  machine_.drives().refuse_with(Error{.reason = Reason::moving, .where = {.bus = "line-a", .node = 1}});
  v1::WriteParametersRequest write;
  write.set_axis("feeder");
  write.add_values()->set_name("lock_current");
  v1::WriteParametersResponse response;
  const auto status = call(*drives_, &Drives::WriteParameters, write, response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(detail_of(status).bus(), "line-a");
}

TEST_F(DriveCalls, MemoryNeedsTheNameAgain) {
  v1::SaveParametersRequest save;
  save.set_axis("feeder");
  save.set_confirm("turntable");
  v1::SaveParametersResponse saved;
  EXPECT_EQ(call(*drives_, &Drives::SaveParameters, save, saved).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  v1::RestoreFactoryRequest restore;
  restore.set_axis("feeder");
  v1::RestoreFactoryResponse restored;
  const auto status = call(*drives_, &Drives::RestoreFactory, restore, restored);
  EXPECT_THAT(detail_of(status).remedy(), HasSubstr("repeat the axis's name in confirm: feeder"));
  EXPECT_THAT(machine_.drives().log(), ElementsAre());
  save.set_confirm("feeder");
  restore.set_confirm("feeder");
  EXPECT_TRUE(call(*drives_, &Drives::SaveParameters, save, saved).ok());
  EXPECT_TRUE(call(*drives_, &Drives::RestoreFactory, restore, restored).ok());
  EXPECT_EQ(restored.after_power_cycle(), "node by its switches, 9600 8N1");
  EXPECT_THAT(machine_.drives().log(), ElementsAre("save_parameters feeder by " + own_name(),
                                                   "restore_factory feeder by " + own_name()));
}

TEST_F(DriveCalls, SegmentsAreReplacedAsAWhole) {
  v1::ReadSegmentsRequest read;
  read.set_axis("feeder");
  v1::ReadSegmentsResponse table;
  ASSERT_TRUE(call(*drives_, &Drives::ReadSegments, read, table).ok());
  EXPECT_TRUE(table.segments().absolute());
  ASSERT_EQ(table.segments().positions_size(), 1);
  EXPECT_EQ(table.segments().positions(0).acceleration_time().nanos(), 100'000'000);
  v1::WriteSegmentsRequest write;
  write.set_axis("feeder");
  v1::WriteSegmentsResponse written;
  EXPECT_EQ(call(*drives_, &Drives::WriteSegments, write, written).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  *write.mutable_segments() = table.segments();
  ASSERT_TRUE(call(*drives_, &Drives::WriteSegments, write, written).ok());
  EXPECT_EQ(written.segments().positions(0).target(), -5);
  EXPECT_THAT(machine_.drives().log(),
              ElementsAre("read_segments feeder",
                          "write_segments feeder by " + own_name() + " absolute 2:-5:10:100"));
}

TEST_F(DriveCalls, DevicesAndSingleExchanges) {
  v1::ListDevicesResponse devices;
  ASSERT_TRUE(call(*buses_, &Buses::ListDevices, v1::ListDevicesRequest(), devices).ok());
  ASSERT_EQ(devices.devices_size(), 1);
  EXPECT_EQ(devices.devices(0).values(0).value(), 2.5);
  EXPECT_FALSE(devices.devices(0).values(1).has_value());
  v1::WriteDeviceRequest write;
  write.set_device("valves");
  write.set_register_("pressure");
  write.set_value(3);
  v1::WriteDeviceResponse written;
  ASSERT_TRUE(call(*buses_, &Buses::WriteDevice, write, written).ok());
  EXPECT_EQ(written.value(), 3.01);
  v1::TransactRequest transact;
  transact.set_bus("line-a");
  transact.set_node(9);
  transact.set_read(2);
  v1::TransactResponse words;
  ASSERT_TRUE(call(*buses_, &Buses::Transact, transact, words).ok());
  EXPECT_THAT(words.values(), ElementsAre(7, 7));
  transact.mutable_write()->add_values(5);
  ASSERT_TRUE(call(*buses_, &Buses::Transact, transact, words).ok());
  transact.set_node(0);
  EXPECT_FALSE(call(*buses_, &Buses::Transact, transact, words).ok());
  EXPECT_THAT(machine_.nodes().log(),
              ElementsAre("write_device valves pressure 3", "transact line-a 9 0x0 count 2 writes ",
                          "transact line-a 9 0x0 count 1 writes 5"));
}

TEST_F(DriveCalls, SingleTransfersOfObjects) {
  v1::TransactRequest transact;
  transact.set_bus("can0");
  transact.set_node(9);
  transact.set_address(0x604100);
  transact.mutable_read_object();
  v1::TransactResponse read;
  ASSERT_TRUE(call(*buses_, &Buses::Transact, transact, read).ok());
  EXPECT_EQ(read.data(), "\xFE\xFF");
  EXPECT_EQ(read.value(), 0xFFFE);
  transact.mutable_read_object()->set_type(v1::PARAMETER_TYPE_INT16);
  ASSERT_TRUE(call(*buses_, &Buses::Transact, transact, read).ok());
  EXPECT_EQ(read.value(), -2);
  transact.mutable_read_object()->set_type(v1::PARAMETER_TYPE_UINT32);
  ASSERT_TRUE(call(*buses_, &Buses::Transact, transact, read).ok());
  EXPECT_FALSE(read.has_value()) << "it has two bytes";
  transact.mutable_write_object()->mutable_number()->set_value(-2);
  transact.mutable_write_object()->mutable_number()->set_type(v1::PARAMETER_TYPE_INT16);
  v1::TransactResponse written;
  ASSERT_TRUE(call(*buses_, &Buses::Transact, transact, written).ok());
  EXPECT_EQ(written.data() + std::to_string(written.has_value()), "0");
  transact.set_node(128);
  EXPECT_FALSE(call(*buses_, &Buses::Transact, transact, written).ok());
  EXPECT_THAT(machine_.nodes().log(), ElementsAre("transact_object can0 9 0x604100 writes ",
                                                  "transact_object can0 9 0x604100 writes ",
                                                  "transact_object can0 9 0x604100 writes ",
                                                  "transact_object can0 9 0x604100 writes 0xfe,0xff"));
}

}  // namespace
}  // namespace axisd::testing
