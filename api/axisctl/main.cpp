#include "api/axisctl/invocation.hpp"

int main(int argc, char** argv) { return axisd::axisctl::run(argc, argv); }
