# Writes the commit the programs were built from; run at every build, rewrites only when it changed. A changed source makes it
# dirty; results kept in cases/*/reference are no sources.
execute_process(COMMAND git -c safe.directory=* -C ${SOURCE} describe --always --abbrev=12 OUTPUT_VARIABLE commit
                OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(commit)
  execute_process(COMMAND git -c safe.directory=* -C ${SOURCE} diff --quiet HEAD -- :/ ":(exclude)cases/*/reference/*" RESULT_VARIABLE changed ERROR_QUIET)
  if(changed)
    string(APPEND commit "-dirty")
  endif()
else()
  set(commit "unknown")
endif()
file(CONFIGURE OUTPUT ${OUT} CONTENT "#define GRAINPAIR_COMMIT \"${commit}\"\n")
