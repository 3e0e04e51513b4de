<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="singleSymbol" forceraster="0" enableorderby="0" symbollevels="0">
    <symbols>
      <symbol name="0" type="line" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleLine" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="line_color" value="255,255,255,200"/>
            <Option type="QString" name="line_style" value="solid"/>
            <Option type="QString" name="line_width" value="1.1"/>
            <Option type="QString" name="line_width_unit" value="MM"/>
            <Option type="QString" name="capstyle" value="round"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
        <layer class="SimpleLine" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="line_color" value="40,52,64,255"/>
            <Option type="QString" name="line_style" value="solid"/>
            <Option type="QString" name="line_width" value="0.5"/>
            <Option type="QString" name="line_width_unit" value="MM"/>
            <Option type="QString" name="capstyle" value="round"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
        <layer class="MarkerLine" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="placement" value="interval"/>
            <Option type="QString" name="interval" value="45"/>
            <Option type="QString" name="interval_unit" value="MM"/>
            <Option type="QString" name="rotate" value="1"/>
            <Option type="QString" name="offset_along_line" value="22"/>
            <Option type="QString" name="offset_along_line_unit" value="MM"/>
          </Option>
          <symbol name="@0@2" type="marker" alpha="1" clip_to_extent="1" force_rhr="0">
            <layer class="SimpleMarker" enabled="1" locked="0" pass="0">
              <Option type="Map">
                <Option type="QString" name="name" value="filled_arrowhead"/>
                <Option type="QString" name="color" value="40,52,64,255"/>
                <Option type="QString" name="outline_style" value="no"/>
                <Option type="QString" name="size" value="3"/>
                <Option type="QString" name="size_unit" value="MM"/>
              </Option>
            </layer>
          </symbol>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
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
    <field name="tunnel" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="vertices" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="interpolated" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="edited" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="label_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="label_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" field="id" name="Survey key"/>
    <alias index="1" field="survey_id" name="Survey key (again)"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="tunnel" name="Tunnel"/>
    <alias index="4" field="vertices" name="Vertices"/>
    <alias index="5" field="interpolated" name="Interpolated"/>
    <alias index="6" field="edited" name="Edited by hand"/>
    <alias index="7" field="chainage_from" name="Chainage from (m)"/>
    <alias index="8" field="chainage_to" name="Chainage to (m)"/>
    <alias index="9" field="label_from" name="From"/>
    <alias index="10" field="label_to" name="To"/>
  </aliases>
  <editable>
    <field name="id" editable="0"/>
    <field name="survey_id" editable="0"/>
    <field name="survey" editable="0"/>
    <field name="tunnel" editable="0"/>
    <field name="vertices" editable="0"/>
    <field name="interpolated" editable="0"/>
    <field name="edited" editable="0"/>
    <field name="chainage_from" editable="0"/>
    <field name="chainage_to" editable="0"/>
    <field name="label_from" editable="0"/>
    <field name="label_to" editable="0"/>
  </editable>
  <previewExpression>"survey"</previewExpression>
  <mapTip>&lt;b&gt;[% replace("survey", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;/b&gt;&lt;br&gt;[% replace("label_from", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %] – [% replace("label_to", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]</mapTip>
  <renderer-3d type="vector">
    <vector-layer-3d-tiling show-bounding-boxes="0" zoom-levels-count="3"/>
    <symbol type="line" material_type="simpleline">
      <data alt-clamping="absolute" alt-binding="vertex" offset="0" extrusion-height="0" simple-lines="1" width="4"/>
      <material ambient="40,52,64,255"/>
    </symbol>
  </renderer-3d>
  <layerGeometryType>1</layerGeometryType>
</qgis>
