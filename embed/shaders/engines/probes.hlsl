// `probes` in an engine that numbers its own registers, as Unity and Unreal do: textures for the texture unit's
// filter, without visibility.

#define DAPPLE_PROBES_CUSTOM
#include "../hlsl/probes_textures.hlsl"

// The seven planes of `ProbesTexels`, four half floats a texel. The sampler is linear and clamps; Unity makes it
// from its name, Unreal takes it as a parameter.
Texture3D<float4> DapplePlaneA;
Texture3D<float4> DapplePlaneB;
Texture3D<float4> DapplePlaneC;
Texture3D<float4> DapplePlaneD;
Texture3D<float4> DapplePlaneE;
Texture3D<float4> DapplePlaneF;
Texture3D<float4> DapplePlaneG;
SamplerState dapple_linear_clamp_sampler;
// `tables/environments.f32`.
StructuredBuffer<float2> DappleEnvironments;

ret_dapple_probes_filtered dapple_probes_filtered(float3 uvw) {
    float4 values[7] = {
        DapplePlaneA.SampleLevel(dapple_linear_clamp_sampler, uvw, 0.0),
        DapplePlaneB.SampleLevel(dapple_linear_clamp_sampler, uvw, 0.0),
        DapplePlaneC.SampleLevel(dapple_linear_clamp_sampler, uvw, 0.0),
        DapplePlaneD.SampleLevel(dapple_linear_clamp_sampler, uvw, 0.0),
        DapplePlaneE.SampleLevel(dapple_linear_clamp_sampler, uvw, 0.0),
        DapplePlaneF.SampleLevel(dapple_linear_clamp_sampler, uvw, 0.0),
        DapplePlaneG.SampleLevel(dapple_linear_clamp_sampler, uvw, 0.0)
    };
    return values;
}

float2 dapple_probes_environment_entry(uint entry) { return DappleEnvironments[entry]; }

// Read by `dapple_probes_visibility_weighted` alone, which this file is not for.
ret_dapple_probes_values dapple_probes_values(DappleProbesVolume volume, uint probe) {
    float4 values[7] = { (float4)0, (float4)0, (float4)0, (float4)0, (float4)0, (float4)0, (float4)0 };
    return values;
}

bool dapple_probes_present(uint probe) { return false; }

uint2 dapple_probes_visibility(uint texel) { return uint2(255, 0); }
