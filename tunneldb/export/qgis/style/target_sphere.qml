<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="singleSymbol" forceraster="0" enableorderby="0" symbollevels="0">
    <symbols>
      <symbol name="0" type="marker" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="name" value="circle"/>
            <Option type="QString" name="color" value="31,166,74,255"/>
            <Option type="QString" name="outline_color" value="255,255,255,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.4"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="size" value="3.6"/>
            <Option type="QString" name="size_unit" value="MM"/>
          </Option>
        </layer>
        <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="name" value="cross"/>
            <Option type="QString" name="color" value="255,255,255,255"/>
            <Option type="QString" name="outline_color" value="255,255,255,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.3"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="size" value="2"/>
            <Option type="QString" name="size_unit" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="'T' || &quot;number&quot;" isExpression="1" fontFamily="Sans Serif" namedStyle="Regular" fontWeight="50" fontSize="8" fontSizeUnit="Point" textColor="40,52,64,255" textOpacity="1" multilineHeight="1" allowHtml="0">
        <text-buffer bufferDraw="1" bufferSize="0.7" bufferSizeUnits="MM" bufferColor="255,255,255,215" bufferOpacity="1" bufferJoinStyle="128" bufferNoFill="1"/>
        <background shapeDraw="0"/>
        <shadow shadowDraw="0"/>
      </text-style>
      <text-format multilineAlign="1"/>
      <placement placement="6" dist="1.6" distUnits="MM" predefinedPositionOrder="R,TR,BR,L,TL,BL" priority="6"/>
      <rendering scaleVisibility="1" scaleMin="0" scaleMax="10000" obstacle="1" obstacleFactor="1" displayAll="0" drawLabels="1" upsidedownLabels="0" fontLimitPixelSize="0" mergeLines="0" limitNumLabels="0" minFeatureSize="0"/>
      <dd_properties>
        <Option type="Map">
          <Option type="QString" name="name" value=""/>
          <Option type="Map" name="properties">
            <Option type="Map" name="Show">
              <Option type="bool" name="active" value="true"/>
              <Option type="QString" name="expression" value='"scan_id" = minimum("scan_id", group_by:="number")'/>
              <Option type="int" name="type" value="3"/>
            </Option>
          </Option>
          <Option type="QString" name="type" value="collection"/>
        </Option>
      </dd_properties>
    </settings>
  </labeling>
  <fieldConfiguration>
    <field name="id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="km" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="segment" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="number" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="scan_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="label" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="x" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="y" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="z" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="radius" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="nominal" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="rms" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="sigma" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="coverage" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="points" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="found_at" configurationFlags="None">
      <editWidget type="DateTime">
        <config>
          <Option type="Map">
            <Option type="bool" name="allow_null" value="true"/>
            <Option type="bool" name="calendar_popup" value="true"/>
            <Option type="QString" name="display_format" value="yyyy-MM-dd HH:mm"/>
            <Option type="bool" name="field_iso_format" value="false"/>
          </Option>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" field="id" name="Key"/>
    <alias index="1" field="survey_id" name="Survey key"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="km" name="Kilometre"/>
    <alias index="4" field="segment" name="Segment"/>
    <alias index="5" field="number" name="Number"/>
    <alias index="6" field="scan_id" name="Scan"/>
    <alias index="7" field="chainage" name="Chainage (m)"/>
    <alias index="8" field="label" name="Chainage"/>
    <alias index="9" field="x" name="x (m)"/>
    <alias index="10" field="y" name="y (m)"/>
    <alias index="11" field="z" name="z (m)"/>
    <alias index="12" field="radius" name="Radius (m)"/>
    <alias index="13" field="nominal" name="Nominal radius (m)"/>
    <alias index="14" field="rms" name="RMS of the fit (m)"/>
    <alias index="15" field="sigma" name="Standard deviation of the centre (m)"/>
    <alias index="16" field="coverage" name="Share of the sphere seen"/>
    <alias index="17" field="points" name="Points"/>
    <alias index="18" field="found_at" name="Found at"/>
  </aliases>
  <editable>
    <field name="id" editable="0"/>
    <field name="survey_id" editable="0"/>
    <field name="survey" editable="0"/>
    <field name="km" editable="0"/>
    <field name="segment" editable="0"/>
    <field name="number" editable="0"/>
    <field name="scan_id" editable="0"/>
    <field name="chainage" editable="0"/>
    <field name="label" editable="0"/>
    <field name="x" editable="0"/>
    <field name="y" editable="0"/>
    <field name="z" editable="0"/>
    <field name="radius" editable="0"/>
    <field name="nominal" editable="0"/>
    <field name="rms" editable="0"/>
    <field name="sigma" editable="0"/>
    <field name="coverage" editable="0"/>
    <field name="points" editable="0"/>
    <field name="found_at" editable="0"/>
  </editable>
  <editorlayout>tablayout</editorlayout>
  <attributeEditorForm>
    <attributeEditorContainer name="Target sphere" columnCount="1" groupBox="1" showLabel="1" visibilityExpressionEnabled="0" visibilityExpression="">
      <attributeEditorField name="number" index="5" showLabel="1"/>
      <attributeEditorField name="scan_id" index="6" showLabel="1"/>
      <attributeEditorField name="label" index="8" showLabel="1"/>
      <attributeEditorField name="x" index="9" showLabel="1"/>
      <attributeEditorField name="y" index="10" showLabel="1"/>
      <attributeEditorField name="z" index="11" showLabel="1"/>
      <attributeEditorField name="radius" index="12" showLabel="1"/>
      <attributeEditorField name="nominal" index="13" showLabel="1"/>
      <attributeEditorField name="rms" index="14" showLabel="1"/>
      <attributeEditorField name="sigma" index="15" showLabel="1"/>
      <attributeEditorField name="coverage" index="16" showLabel="1"/>
      <attributeEditorField name="points" index="17" showLabel="1"/>
      <attributeEditorField name="found_at" index="18" showLabel="1"/>
    </attributeEditorContainer>
  </attributeEditorForm>
  <previewExpression>'T' || "number"</previewExpression>
  <mapTip>&lt;b&gt;T[% "number" %]&lt;/b&gt; at [% replace("label", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %], scan [% "scan_id" %]&lt;br&gt;radius [% format_number("radius" * 1000, 2) %] mm, rms [% format_number("rms" * 1000, 2) %] mm, [% round("coverage" * 100) %] % seen</mapTip>
  <renderer-3d type="vector">
    <vector-layer-3d-tiling show-bounding-boxes="0" zoom-levels-count="3"/>
    <symbol type="point" shape="sphere" material_type="phong">
      <data alt-clamping="absolute"/>
      <material ambient="15,80,36,255" diffuse="31,166,74,255" specular="220,255,230,255" shininess="20"/>
      <shape-properties>
        <Option type="Map">
          <Option type="double" name="radius" value="0.3"/>
        </Option>
      </shape-properties>
      <transform matrix="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/>
    </symbol>
  </renderer-3d>
  <layerGeometryType>0</layerGeometryType>
</qgis>
