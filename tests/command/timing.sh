#!/usr/bin/env bash
# Time never changes pixels: the image of every level, and of a dozen settings of keys of time, is byte for byte the function level's. Planes are
# compared within each run of a deeper level, which is refused if one differs.
source "$(dirname "$0")/check.bash"

"$ropsim" record transparent:scene:knot,rings=48,sides=8 --size 96x64 -o "$work/knot.ropt" >/dev/null 2>&1 || complain "no scene"
"$ropsim" record scene:soup,count=150 --size 40x56 --samples 4 -o "$work/soup.ropt" >/dev/null 2>&1 || complain "no scene"

settings=(
    "core_mhz=1000"
    "partitions=1 partition_row_step=0"
    "partitions=7 partition_row_step=3"
    "memory_mhz=100 memory_banks=1 memory_write_queue=1"
    "memory_t_cl=0 memory_t_rcd=0 memory_t_rp=0 memory_t_ras=0 memory_t_rc=0"
    "raster_queue=1 depth_queue=1 color_queue=1 shader_queue=1"
    "cache_misses_max=1 depth_cache_bytes=256 depth_cache_ways=1 color_cache_bytes=256 color_cache_ways=1"
    "interlock=none"
    "interlock=buckets interlock_buckets=2"
    "hierarchical_depth=false early_depth=false"
    "depth_compression=false fast_clear=false"
    "color_compression=true compression_cycles=50"
    "l2_bytes=98304 l2_ways=16 l2_latency_cycles=100"
    "tile_based=true region_pixels=16 binned_bytes=32 on_chip_bits=64"
    "line_bytes=64 memory_burst_bytes=64"
    "triangles_per_kiloclock=10 triangles_ahead=1 raster_blocks_per_clock=1"
    "blend_samples_per_clock=1 color_pixels_per_clock=1 depth_samples_per_clock=1 kernel_slots_per_clock=1"
)

different() {
    local said
    checks=$((checks + 1))
    said=$("$ropsim" run "$1" "$work/$2.ropt" --no-reference --image "$work/timed.pfm" --json "$work/timed.json" "${@:3}" 2>&1) ||
        complain "ropsim run $*: $said"
    cmp -s "$work/function.pfm" "$work/timed.pfm" || complain "ropsim run $*: another image than at the function level"
    awk '$1 == "\"cycles\":" { print $2; exit }' "$work/timed.json" >>"$work/cycles"
}

for case in "layer_peel knot g80" "k_buffer,k=2 knot programmable" "coherent_layer_peel_a soup g80"; do
    read -r program trace machine <<<"$case"
    "$ropsim" run "$program" "$work/$trace.ropt" --machine "$machine" --no-reference --image "$work/function.pfm" >/dev/null || complain "$case fails"
    : >"$work/cycles"
    different "$program" "$trace" --machine "$machine" --detail traffic
    different "$program" "$trace" --machine "$machine" --detail cycle
    for setting in "${settings[@]}"; do
        keys=()
        for key in $setting; do keys+=(--set "$key"); done
        different "$program" "$trace" --machine "$machine" --detail cycle "${keys[@]}"
    done
    # They did change time.
    (($(sort -u "$work/cycles" | wc -l) > ${#settings[@]} - 4)) || complain "$case: settings of time hardly change cycles: $(tr '\n' ' ' <"$work/cycles")"
done
finish
