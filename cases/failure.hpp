// The two ways a program fails, and the codes by which Python tells failures apart: a message may
// be reworded, its code stays. `mpm_case --failures` prints the codes; Python's are in
// cases/errors.py, and a test compares the two.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace grainpair {

/// Bad input, said in one line: `file:line: problem (why) hint`. Programs print it and exit with
/// code 2.
struct CaseError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Why an engine could not go on.
enum class Failure {
  not_finite,
  energy_growth,
  ejected,
  inverted,
  unattainable,
  lost_grains,
  refused,
  library,
  cpu_limit
};

/// What spoils a result without ending its run.
enum class Warning { drift, halved, noise, locking, crowding, loss, tension, end, estimated };

template <class Code>
struct Coded {
  Code code;
  const char* name;
  const char* doc;
};

inline constexpr Coded<Failure> failure_codes[] = {
    {Failure::not_finite, "not-finite", "a quantity of the solution is no number"},
    {Failure::energy_growth, "energy-growth", "the numerics made energy out of nothing"},
    {Failure::ejected, "ejected", "a point left the grid, or is faster than any fall"},
    {Failure::inverted, "inverted", "a point's volume became negative"},
    {Failure::unattainable, "unattainable", "no strain rate gives the stress a path asks for"},
    {Failure::lost_grains, "lost-grains", "grains are gone, or stick to each other"},
    {Failure::refused, "refused", "the grains' time step cannot resolve their contacts"},
    {Failure::library, "library", "a law of a shared library cannot go on, or ended the program"},
    {Failure::cpu_limit, "cpu-limit", "the processor time allowed is used up"},
};

inline constexpr Coded<Warning> warning_codes[] = {
    {Warning::drift, "drift", "the numerics made a share of the energy out of nothing"},
    {Warning::halved, "halved", "steps were too long, and were shortened during the run"},
    {Warning::noise, "noise", "points move in ways that their cells cannot see"},
    {Warning::locking, "locking", "the pressure differs between the points of a cell"},
    {Warning::crowding, "crowding", "points claim more volume than there is room for"},
    {Warning::loss, "loss", "the transfer took much of the energy released"},
    {Warning::tension, "tension", "points pull on each other"},
    {Warning::end, "end", "matter came to the end of the floor"},
    {Warning::estimated, "estimated", "elastic and plastic energy are not the law's own figures"},
};

inline const char* name(Failure code) {
  return std::ranges::find(failure_codes, code, &Coded<Failure>::code)->name;
}
inline const char* name(Warning code) {
  return std::ranges::find(warning_codes, code, &Coded<Warning>::code)->name;
}

/// The run cannot go on; programs print the line, which ends in its code in brackets, and exit with
/// code 3.
struct SolverError : std::runtime_error {
  template <class... Args>
  SolverError(Failure failure, fmt::format_string<Args...> line, Args&&... args)
      : std::runtime_error(
            fmt::format("{} [{}]", fmt::format(line, std::forward<Args>(args)...), name(failure))),
        code(failure) {}
  /// Of a line that ends in its code already.
  SolverError(Failure failure, const std::string& whole)
      : std::runtime_error(whole), code(failure) {}
  Failure code;
};

}  // namespace grainpair
