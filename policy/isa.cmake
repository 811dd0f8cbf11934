# The scan's inner loops are compiled once per instruction set and chosen at run time.
function(flowscope_isa_flags target folder)
  # No calls to memcpy from inner loops: every vector register would have to be saved around them.
  set(kernel_flags -O3 -ffp-contract=fast -fno-math-errno -fno-tree-loop-distribute-patterns)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    set(avx2_flags -mavx2 -mfma)
    set(avx512_flags -mavx512f -mavx2 -mfma -mprefer-vector-width=512)
  endif()
  foreach(isa portable avx2 avx512)
    # Flags that differ from the target's own: its precompiled header does not fit.
    set_source_files_properties(${folder}/mamba_kernels_${isa}.cc ${folder}/token_kernels_${isa}.cc TARGET_DIRECTORY ${target}
      PROPERTIES COMPILE_OPTIONS "${kernel_flags};${${isa}_flags}" SKIP_PRECOMPILE_HEADERS ON)
    # A choice of points must be the same on every machine: no fused multiply-add here.
    set_source_files_properties(${folder}/point_kernels_${isa}.cc TARGET_DIRECTORY ${target}
      PROPERTIES COMPILE_OPTIONS "-O3;${${isa}_flags};-ffp-contract=off" SKIP_PRECOMPILE_HEADERS ON)
  endforeach()
endfunction()
