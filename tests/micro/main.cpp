// micro_benchmarks: times of the parts that pictures and packs are made of. Options are Google Benchmark's: --help.
#include "tests/micro/lanes.h"

#include <benchmark/benchmark.h>

int main(int argc, char** argv)
{
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv))
        return 1;
    benchmark::AddCustomContext("instruction_set", trimray::micro::lanes_name());
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
