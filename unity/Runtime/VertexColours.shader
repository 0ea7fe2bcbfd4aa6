// A stream's colours as they were captured, without light. For the built-in and the universal render pipeline.
Shader "Htvm/Vertex colours"
{
    SubShader
    {
        Tags { "RenderType" = "Opaque" }
        Pass
        {
            CGPROGRAM
            #pragma vertex place
            #pragma fragment paint
            #include "UnityCG.cginc"

            struct Corner
            {
                float4 position : SV_POSITION;
                half3 colour : COLOR;
            };

            Corner place(appdata_full vertex)
            {
                Corner corner;
                corner.position = UnityObjectToClipPos(vertex.vertex);
                corner.colour = vertex.color.rgb;
                #ifndef UNITY_COLORSPACE_GAMMA
                corner.colour = GammaToLinearSpace(corner.colour);
                #endif
                return corner;
            }

            half4 paint(Corner corner) : SV_Target
            {
                return half4(corner.colour, 1);
            }
            ENDCG
        }
    }
}
