#!/usr/bin/env bash
# Installs compiler and libraries of CUDA from Python packages (proprietary, free of charge) in the folder ORATOR_CUDA, for
# `cargo build --features cuda`: no GPU and no driver are needed. Sourcing its file `environment` selects them.
. "$(dirname "$0")/lib.sh"

list=tests/cuda.txt
folder=$(realpath -m "${ORATOR_CUDA:-$target/cuda}")
[ -e "$folder/environment" ] && pip_folder_is_there "$list" "$folder" && exit 0
need_packages g++
find_python 3 python3 /usr/bin/python3 || fail 'no pip for any python3'
pip_folder "$list" "$folder"

# Names for the linker, without contents: the program loads the libraries when it opens a GPU (src/nn/cuda).
home=$folder/nvidia/cu13
mkdir -p "$home/lib/stubs"
for library in cuda cudart cublas cublasLt curand nvrtc cudnn; do
    ar rc "$home/lib/stubs/lib$library.a"
done

# candle's kernels of quantised networks take half an hour of a core, and the program has no such networks: they are
# compiled from empty files.
mkdir -p "$folder/bin" "$folder/empty"
cat >"$folder/bin/nvcc" <<END
#!/usr/bin/env bash
source=\${*: -1}
case \$source in
*src/moe/*.cu | *src/mmq_gguf/*.cu | *src/mmvq_gguf.cu | *src/quantized.cu)
    : >"$folder/empty/\${source##*/}"
    set -- "\${@:1:\$#-1}" "$folder/empty/\${source##*/}"
    ;;
esac
exec "$home/bin/nvcc" "\$@"
END
chmod +x "$folder/bin/nvcc"

# The kernels are PTX, which the driver compiles for its GPU: that of compute capability 8.0 runs on every GPU since
# 2020, whereas the build of candle compiles 9.0 for these GPUs only.
cat >"$folder/environment" <<END
export ORATOR_CUDA=$folder CUDA_HOME=$home NVCC=$folder/bin/nvcc CUDARC_CUDA_VERSION=13000
export CUDA_COMPUTE_CAP=\${CUDA_COMPUTE_CAP:-80}
END
